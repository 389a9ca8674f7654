#include "palpate/estimate/tissue_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/core/stopwatch.h"
#include "palpate/estimate/build_stages.h"
#include "palpate/estimate/check_map.h"
#include "palpate/estimate/find_edges.h"
#include "palpate/instrument/instrument_finder.h"
#include "palpate/stereo/fuse.h"
#include "palpate/stereo/quasi_dense.h"
#include "palpate/stereo/triangulate.h"

namespace palpate {

namespace {

/// Organ region without instruments, highlights and the border of the scope.
cv::Mat tissue_mask(const RectifiedPair& pair, const Rectification& rectification, const cv::Mat& organ_mask) {
  InstrumentOptions ours;
  ours.segmentation = "learned";
  const cv::Mat instrument = InstrumentFinder(ours, pair.left, organ_mask).find(pair.left).mask;
  cv::Mat mask = organ_mask & matchable_mask(pair.left) & rectification.valid_left;
  mask.setTo(0, instrument);
  return mask;
}

/// Spacing of S* that lets `elements` tetrahedra follow it: a third of the edge of regular tetrahedra that fill the
/// body.
double spacing_for(const PointCloud& cloud, const Rectification& rectification, const MapOptions& options) {
  if (options.surface.spacing_mm > 0) return options.surface.spacing_mm;
  double area_mm2 = 0;
  for (const Vec3& p : cloud.position_mm) area_mm2 += std::pow(p.z() / rectification.focal_px, 2);
  const double element_mm3 = area_mm2 * options.thickness_mm / options.elements;
  const double edge_mm = std::cbrt(6 * std::sqrt(2.0) * element_mm3);
  return std::clamp(edge_mm / 3, 0.6, 3.0);
}

/// Where the elements shall be finer; of a polygon, the tissue seen in it. Throws BadInput where there is none.
std::optional<MeshFocus> focus_of(const MapOptions& options, const Surface& seen, const StereoRig& rig) {
  if (options.has_focus) return MeshFocus{options.focus_center_mm, options.focus_radius_mm, options.focus_edge_ratio};
  if (options.focus_px.empty()) return {};
  constexpr double kRadius_mm = 3, kApart_mm = 2;
  const std::vector<cv::Point2f> corners(options.focus_px.begin(), options.focus_px.end());
  std::vector<Vec3> centers;
  for (const Vec3& v : seen.vertices_mm)
    if (cv::pointPolygonTest(corners, cv::Point2f(project_to_recorded_left(rig, v)), false) >= 0 &&
        std::none_of(centers.begin(), centers.end(), [&](const Vec3& c) { return (c - v).norm() < kApart_mm; }))
      centers.push_back(v);
  if (centers.empty()) throw BadInput("map.focus_px: no tissue was measured in it, expected a part of the organ");
  MeshFocus focus{centers.front(), kRadius_mm, options.focus_edge_ratio};
  focus.also_around_mm.assign(centers.begin() + 1, centers.end());
  return focus;
}

/// Moves the body where the camera sees it. Throws BadInput where it fits worse than the options allow.
Registration register_to(const PointCloud& seen, const MapOptions& options, Surface& body) {
  constexpr double kMinFraction = 0.6;
  const Registration found = register_body(
      body, seen.position_mm, options.has_register_from ? std::optional(options.register_from) : std::nullopt);
  if (found.residual_mm > options.register_limit_mm || found.matched_fraction < kMinFraction)
    throw BadInput(fmt::format(
        "map.register: {} fits the measured tissue to {:.2f} mm over {:.0f} % of it, expected at most {:g} mm over at "
        "least {:.0f} % (is it this organ? say roughly where it lies by register_from)",
        options.volume.string(), found.residual_mm, 100 * found.matched_fraction, options.register_limit_mm,
        100 * kMinFraction));
  for (Vec3& v : body.vertices_mm) v = found.apply(v);
  return found;
}

}  // namespace

TissueMap build_tissue_map(const StereoFrame& frame, const Rectification& rectification, const MapOptions& options,
                           const TissueOptions& tissue, const AttachmentOptions& attachments) {
  return build_tissue_map(std::vector<StereoFrame>{frame}, rectification, options, tissue, attachments);
}

TissueMap build_tissue_map(const std::vector<StereoFrame>& static_frames, const Rectification& rectification,
                           const MapOptions& options, const TissueOptions& tissue,
                           const AttachmentOptions& attachments) {
  return build_tissue_map(static_frames, rectification, options, tissue, attachments, [](const std::string&) {});
}

TissueMap build_tissue_map(const std::vector<StereoFrame>& static_frames, const Rectification& rectification,
                           const MapOptions& options, const TissueOptions& tissue, const AttachmentOptions& attachments,
                           const OnStage& on_stage) {
  if (static_frames.empty()) throw BadInput("no static frame to build the map from");
  const StereoFrame& frame = static_frames.back();
  TissueMap map;
  map.tissue = tissue;
  map.element = options.element;
  map.is_given = !options.volume.empty();
  map.frame = frame.index;
  Stopwatch watch;
  map.organ_mask = rectified_polygon_mask(rectification, options.organ_region_px);
  RectifiedPair pair;
  cv::Mat mask;
  std::vector<DisparityMap> disparities;
  for (const StereoFrame& one : static_frames) {
    on_stage("rectify");
    pair = rectify(rectification, one);
    mask = tissue_mask(pair, rectification, map.organ_mask);
    map.report.rectify_ms += watch.lap_ms();
    on_stage("match");
    disparities.push_back(match(pair, rectification, mask, options.match));
    map.report.match_ms += watch.lap_ms();
  }
  map.disparity = disparities.size() == 1 ? disparities.front() : fuse(disparities);
  map.report.match_ms += watch.lap_ms();

  on_stage("triangulate");
  map.cloud = triangulate(map.disparity, rectification, pair.left);
  map.report.triangulate_ms = watch.lap_ms();

  on_stage("edges");
  const cv::Mat covered = map.organ_mask & rectification.valid_left & ~mask;
  const DepthEdges edges = find_edges(map.cloud, rectification, covered, options.edges);
  std::vector<PointCloud> groups = split_at_edges(map.cloud, edges);
  map.report.edges_ms = watch.lap_ms();

  on_stage("surface");
  const double spacing_mm = spacing_for(groups.front(), rectification, options);
  map.pieces = cut_surfaces(std::move(groups), edges, spacing_mm, options.surface);
  map.surface = map.pieces.front().surface;
  map.seen = seen_tissue(map.surface, edges.cells);
  map.report.surface_ms = watch.lap_ms();

  Surface body = options.volume.empty() ? close_body(map.surface, options.thickness_mm)
                                        : read_body(options.volume, options.volume_unit);
  if (options.register_volume) {
    on_stage("register");
    map.report.registration = register_to(map.pieces.front().clean, options, body);
    map.report.register_ms = watch.lap_ms();
  }
  if (!options.volume.empty())
    require_body_where_seen(body, map.disparity, rectification, map.organ_mask, options.volume);
  on_stage("volume");
  map.mesh =
      tetrahedralize(body, options.elements, focus_of(options, map.surface, rectification.rig), &map.report.mesh);
  map.report.volume_ms = watch.lap_ms();

  on_stage("attachments");
  const auto project_px = [&rectification](const Vec3& point) {
    return project_to_recorded_left(rectification.rig, point);
  };
  assign_labels(map.mesh, options.labels, frame.left.size(), project_px);
  for (const TissueLabel& label : options.labels) map.tissue.of_label.push_back(label.tissue);
  map.attachments = attachments;
  map.fixed_nodes = select_attachments(map.mesh, attachments, project_px);
  require_every_piece_held(map.mesh, map.fixed_nodes);
  map.report.attachments_ms = watch.lap_ms();

  map.report.matched_points = static_cast<int>(map.cloud.size());
  map.report.coverage = static_cast<double>(map.cloud.size()) / std::max(1, cv::countNonZero(map.organ_mask));
  map.report.median_depth_deviation_mm = static_cast<double>(median_of(map.cloud.depth_deviation_mm));
  return map;
}

}  // namespace palpate
