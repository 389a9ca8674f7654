#pragma once

#include <filesystem>
#include <optional>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/elastic/material.h"
#include "palpate/elastic/tet_model.h"
#include "palpate/estimate/tissue_labels.h"
#include "palpate/stereo/match.h"
#include "palpate/stereo/rig.h"
#include "palpate/surface/cut_surface.h"
#include "palpate/surface/seen_tissue.h"
#include "palpate/volume/attachments.h"
#include "palpate/volume/body.h"
#include "palpate/volume/register_body.h"
#include "palpate/volume/tetrahedralize.h"

namespace palpate {

/// `map` of the scene file.
struct MapOptions {
  int frame = 0;
  cv::Point2d frames;  ///< first and last of the static frames that are fused; equal = `frame` alone
  int elements = 1344;

  int first_frame() const { return frames.x < frames.y ? static_cast<int>(frames.x) : frame; }
  std::vector<cv::Point2d> organ_region_px;
  double thickness_mm = 25;
  std::filesystem::path volume;
  LengthUnit volume_unit = LengthUnit::mm;
  bool register_volume = false;
  bool has_register_from = false;
  Registration register_from;      ///< where the operator says that the volume lies
  double register_limit_mm = 1.5;  ///< largest residual
  std::vector<cv::Point2d> focus_px;
  bool has_focus = false;
  Vec3 focus_center_mm = Vec3::Zero();
  double focus_radius_mm = 0;
  double focus_edge_ratio = 0.4;
  std::vector<TissueLabel> labels;
  Element element = Element::averaged;
  MatchOptions match;
  SurfaceOptions surface;
  EdgeOptions edges;  ///< keys of `tuning`
};

void describe(Settings& settings, MapOptions& options);

/// What the build stage took and left, for map.json.
struct MapReport {
  double rectify_ms = 0, match_ms = 0, triangulate_ms = 0, edges_ms = 0, surface_ms = 0, register_ms = 0, volume_ms = 0,
         attachments_ms = 0;
  int matched_points = 0;
  double coverage = 0;  ///< fraction of the organ region with a measured disparity
  double median_depth_deviation_mm = 0;
  MeshReport mesh;
  std::optional<Registration> registration;
};

/// V of Eq. 1 and everything seen on the way to it.
struct TissueMap {
  PointCloud cloud;                  ///< S
  Surface surface;                   ///< S*
  std::vector<SurfacePiece> pieces;  ///< S* first; what else was seen can be touched, but is no part of V
  SeenTissue seen;                   ///< which places of S* were seen
  bool is_given = false;             ///< V is a scan, not what was seen with a thickness
  TetMesh mesh;                      ///< V
  std::vector<int> fixed_nodes;      ///< b
  AttachmentOptions attachments;     ///< where b was taken from, for meshes that are finer somewhere
  TissueOptions tissue;              ///< gamma
  Element element = Element::averaged;
  DisparityMap disparity;
  cv::Mat organ_mask;  ///< 255 = organ region, rectified left image
  int frame = 0;       ///< the static frame
  MapReport report;
};

/// Phi of Eq. 1. Throws BadInput with a sentence where a stage cannot go on.
TissueMap build_tissue_map(const StereoFrame& frame, const Rectification& rectification, const MapOptions& options,
                           const TissueOptions& tissue, const AttachmentOptions& attachments);

/// From several frames in which camera and tissue stand still; the last one is the static frame of the map.
TissueMap build_tissue_map(const std::vector<StereoFrame>& static_frames, const Rectification& rectification,
                           const MapOptions& options, const TissueOptions& tissue,
                           const AttachmentOptions& attachments);

}  // namespace palpate
