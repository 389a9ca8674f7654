#include "palpate/contact/gap.h"

#include <Eigen/Geometry>
#include <stdexcept>

namespace palpate {

Gap gap_to_surface(const Vec3& tip_mm, const std::vector<Vec3>& nodes_mm, const std::vector<Triangle>& boundary) {
  const ClosestPoint nearest = closest_point(tip_mm, nodes_mm, boundary);
  if (nearest.triangle < 0) throw std::invalid_argument("gap_to_surface: the body has no surface");
  const Triangle& t = boundary[static_cast<size_t>(nearest.triangle)];
  const Vec3& a = nodes_mm[static_cast<size_t>(t[0])];
  Gap gap;
  gap.surface_point_mm = nearest.point;
  gap.triangle = nearest.triangle;
  gap.barycentric = nearest.barycentric;
  gap.normal = (nodes_mm[static_cast<size_t>(t[1])] - a).cross(nodes_mm[static_cast<size_t>(t[2])] - a).normalized();
  const Vec3 from_surface = tip_mm - nearest.point;
  gap.distance_mm = from_surface.dot(gap.normal) >= 0 ? nearest.distance : -nearest.distance;
  return gap;
}

}  // namespace palpate
