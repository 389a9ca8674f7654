#include "palpate/estimate/touchable.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace palpate {

namespace {

/// The boundary of the tetrahedra follows S* to a fraction of their size, and never better than the depth.
constexpr double kReachPerCell = 0.35, kMinReach_mm = 1.5;

/// Whether a point comes within reach of the box around a surface.
bool is_near(const Surface& surface, const Vec3& point_mm, double reach_mm) {
  Vec3 low = surface.vertices_mm.front(), high = low;
  for (const Vec3& v : surface.vertices_mm) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  return (low - point_mm).maxCoeff() < reach_mm && (point_mm - high).maxCoeff() < reach_mm;
}

}  // namespace

Touchable::Touchable(const TissueMap& map, const Rectification& rectification)
    : everything_(map.is_given),
      reach_mm_(std::max(kMinReach_mm, kReachPerCell * map.report.mesh.cell_size_mm)),
      seen_(map.seen) {
  for (size_t i = 1; i < map.pieces.size(); ++i) other_.push_back(map.pieces[i].surface);
  for (int y = 0; y < seen_.cells.closed.rows; ++y)
    for (int x = 0; x < seen_.cells.closed.cols; ++x)
      if (seen_.cells.closed(y, x) && seen_.cells.is_known({x, y}))
        hidden_.push_back({{x, y}, project_to_rectified(rectification, seen_.cells.point_mm({x, y}))});
}

void Touchable::look(const cv::Mat& left_mask) {
  const cv::Rect image({0, 0}, left_mask.size());
  std::erase_if(hidden_, [&](const HiddenCell& hidden) {
    if (image.contains(hidden.rectified_px) && left_mask.at<uchar>(hidden.rectified_px) > 0) return false;
    seen_.cells.closed(hidden.cell) = 0;
    return true;
  });
}

bool Touchable::may_be_held(const Vec3& place_mm) const {
  return everything_ || sight_of(seen_, place_mm, reach_mm_) == SeenTissue::Sight::seen;
}

bool Touchable::is_on_other_tissue(const Vec3& tip_mm, double reach_mm) const {
  return std::any_of(other_.begin(), other_.end(), [&](const Surface& surface) {
    return is_near(surface, tip_mm, reach_mm) &&
           closest_point(tip_mm, surface.vertices_mm, surface.triangles).distance <= reach_mm;
  });
}

double Touchable::beyond_edge(const Vec3& place_mm, double radius_mm) const {
  if (everything_) return 0;
  return std::clamp(1 - distance_to_edge_mm(seen_, place_mm) / radius_mm, 0.0, 1.0);
}

std::vector<Triangle> Touchable::seen_faces(const std::vector<Vec3>& rest_mm,
                                            const std::vector<Triangle>& boundary) const {
  if (everything_) return boundary;
  std::vector<Triangle> seen;
  for (const Triangle& face : boundary) {
    const Vec3 &a = rest_mm[static_cast<size_t>(face[0])], &b = rest_mm[static_cast<size_t>(face[1])],
               &c = rest_mm[static_cast<size_t>(face[2])];
    const Vec3 middle_mm = (a + b + c) / 3;
    if ((b - a).cross(c - a).dot(middle_mm) < 0 && may_be_held(middle_mm)) seen.push_back(face);
  }
  return seen;
}

}  // namespace palpate
