#pragma once

#include "palpate/core/geometry.h"

namespace palpate::test {

/// Closed ellipsoid by subdivision of an icosahedron; four times the triangles per level.
Surface ellipsoid(const Vec3& center_mm, const Vec3& half_axes_mm, int level);

/// Closed box along the axes, twelve triangles.
Surface box(const Vec3& min_mm, const Vec3& max_mm);

/// Regular grid over [-half, half]^2 with z = depth(x, y), oriented towards the camera.
template <class Depth>
Surface height_field(double half_mm, int cells, Depth depth) {
  Surface surface;
  for (int row = 0; row <= cells; ++row)
    for (int column = 0; column <= cells; ++column) {
      const double x = half_mm * (2.0 * column / cells - 1), y = half_mm * (2.0 * row / cells - 1);
      surface.vertices_mm.emplace_back(x, y, depth(x, y));
    }
  for (int row = 0; row < cells; ++row)
    for (int column = 0; column < cells; ++column) {
      const int a = row * (cells + 1) + column, b = a + 1, c = a + cells + 1, d = c + 1;
      surface.triangles.push_back({a, c, b});
      surface.triangles.push_back({b, c, d});
    }
  return surface;
}

/// A block of n x n x n cubes of six tetrahedra each.
TetMesh block(const Vec3& min_mm, double edge_mm, int n);

double total_volume_mm3(const TetMesh& mesh);
double smallest_volume_mm3(const TetMesh& mesh);

/// What is wrong with the boundary ("" = every edge used once in each direction).
std::string boundary_fault(const TetMesh& mesh);

/// Root mean square distance of the surface's vertices to the boundary of the mesh.
double rms_distance_mm(const std::vector<Vec3>& points, const TetMesh& mesh);

}  // namespace palpate::test
