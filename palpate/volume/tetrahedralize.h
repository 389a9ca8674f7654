#pragma once

#include <optional>

#include "palpate/core/geometry.h"

namespace palpate {

/// Where the mesh is wanted finer: edges there are `edge_ratio` times the edge elsewhere, growing outwards.
struct MeshFocus {
  Vec3 center_mm = Vec3::Zero();
  double radius_mm = 0;
  double edge_ratio = 0.5;
  std::vector<Vec3> also_around_mm = {};  ///< middles of further balls of the same radius
};

struct MeshReport {
  int elements = 0;
  double smallest_dihedral_deg = 0;
  double cell_size_mm = 0;
};

/// V of the paper: the inside of a closed surface (where its winding number is positive, so it may overlap itself)
/// filled with CGAL's Delaunay refinement; the cell size is searched so that the count is within 10 % of `elements`.
/// Every element has positive volume and, but for bodies with knife edges, no dihedral angle below 10 degrees; the
/// boundary fits the surface in the mean square, sharp rims are cut off; one piece without hinges. All labels are 0.
/// The same input gives the same mesh. Throws BadInput when the body cannot be filled.
TetMesh tetrahedralize(const Surface& closed_body, int elements, const std::optional<MeshFocus>& focus = {},
                       MeshReport* report = nullptr);

/// The mesh with every tetrahedron that comes within `radius_mm` of `center_mm` split (longest-edge bisection,
/// conforming) until its edges there are at most `edge_mm`. Nodes of the input keep their numbers; labels are
/// inherited.
TetMesh refine_near(const TetMesh& mesh, const Vec3& center_mm, double radius_mm, double edge_mm);

/// Dihedral angles of every element, the smallest one, degrees.
double smallest_dihedral_deg(const TetMesh& mesh);

}  // namespace palpate
