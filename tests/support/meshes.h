#pragma once

#include "palpate/core/geometry.h"

namespace palpate::test {

/// A box of `cells` bricks per axis, each split into six tetrahedra; corner at the origin.
TetMesh box_mesh(const Vec3& size_mm, const std::array<int, 3>& cells);

/// Numbers of the nodes whose coordinate along `axis` is within 1e-9 of `value`.
std::vector<int> nodes_at(const TetMesh& mesh, int axis, double value);

}  // namespace palpate::test
