#pragma once

#include <functional>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

/// One region of `attachments`; exactly one kind is set.
struct AttachmentRegion {
  enum class Kind { none, underside, box, oriented_box, sphere, polygon } kind = Kind::underside;
  double depth_mm = 3;            ///< underside
  Vec3 min_mm = Vec3::Zero();     ///< box
  Vec3 max_mm = Vec3::Zero();     ///< box
  Vec3 center_mm = Vec3::Zero();  ///< oriented box, sphere
  Vec3 half_size_mm = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  ///< rows = unit axes of the oriented box
  double radius_mm = 0;          ///< sphere
  std::vector<cv::Point2d> polygon_px;
};

struct AttachmentOptions {
  std::vector<AttachmentRegion> regions;
};

/// Binds the list `attachments` of the scene file in the group that holds it; each item names exactly one kind of
/// region.
void describe(Settings& scene, AttachmentOptions& options);

/// b of the paper: the nodes in the union of the regions, ascending. `project_px` maps a point in the left camera frame
/// to a pixel of the recorded left image (used by polygons only). Throws BadInput when no node or every node is
/// selected.
std::vector<int> select_attachments(const TetMesh& mesh, const AttachmentOptions& options,
                                    const std::function<cv::Point2d(const Vec3&)>& project_px);

}  // namespace palpate
