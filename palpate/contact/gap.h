#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// Where the tip stands against the surface of the (deformed) body: the proximity test of Eq. 4.
struct Gap {
  double distance_mm = 0;  ///< along the outward normal: positive outside, negative inside
  Vec3 surface_point_mm = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< outward
  int triangle = -1;            ///< of the boundary
  Vec3 barycentric = Vec3::Zero();
};

/// `nodes_mm`: deformed nodes; `boundary`: outward triangles. Throws std::invalid_argument without triangles.
Gap gap_to_surface(const Vec3& tip_mm, const std::vector<Vec3>& nodes_mm, const std::vector<Triangle>& boundary);

}  // namespace palpate
