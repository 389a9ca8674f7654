#pragma once

#include "palpate/core/geometry.h"

/// CGAL's ways from a noisy cloud to a surface, as its tutorial "Surface Reconstruction from Point Clouds" puts them
/// together: outliers removed, one point per grid cell, smoothed by jets, then one of three reconstructions.
namespace palpate::peer {

/// The points that all three start from.
std::vector<Vec3> tidied(const std::vector<Vec3>& points_mm, double spacing_mm);

/// Both with an upper limit to the triangles, so that they do not bridge what is open.
Surface advancing_front(const std::vector<Vec3>& points_mm, double spacing_mm);
Surface scale_space(const std::vector<Vec3>& points_mm, double spacing_mm);
/// Normals by jets, turned to the camera at the origin. Poisson closes every surface: what is farther than twice the
/// spacing from all points is cut off.
Surface poisson(const std::vector<Vec3>& points_mm, double spacing_mm);

}  // namespace palpate::peer
