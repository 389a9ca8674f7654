#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// Smallest of the six dihedral angles of one tetrahedron; 0 where it is turned inside out or flat.
double smallest_dihedral_deg(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// The largest piece of the mesh that hangs together over faces everywhere: where parts meet in an edge or in a node
/// only, which elasticity would see as a hinge, the smaller part is removed. Nodes used by no element are dropped.
TetMesh without_hinges(const TetMesh& mesh);

}  // namespace palpate
