#include "tests/support/meshes.h"

#include <cmath>

namespace palpate::test {

TetMesh box_mesh(const Vec3& size_mm, const std::array<int, 3>& cells) {
  TetMesh mesh;
  const auto number = [&cells](int i, int j, int k) { return i + (cells[0] + 1) * (j + (cells[1] + 1) * k); };
  for (int k = 0; k <= cells[2]; ++k)
    for (int j = 0; j <= cells[1]; ++j)
      for (int i = 0; i <= cells[0]; ++i)
        mesh.nodes_mm.emplace_back(size_mm[0] * i / cells[0], size_mm[1] * j / cells[1], size_mm[2] * k / cells[2]);
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i) {
        // Kuhn's split: six tetrahedra around the diagonal, one per order of the axes.
        const std::array<std::array<int, 3>, 6> orders = {
            {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
        for (const auto& order : orders) {
          std::array<int, 3> corner = {i, j, k};
          Tetrahedron t;
          t[0] = number(i, j, k);
          for (size_t step = 0; step < 3; ++step) {
            ++corner[static_cast<size_t>(order[step])];
            t[step + 1] = number(corner[0], corner[1], corner[2]);
          }
          const auto at = [&mesh](int n) { return mesh.nodes_mm[static_cast<size_t>(n)]; };
          if (signed_volume_mm3(at(t[0]), at(t[1]), at(t[2]), at(t[3])) < 0) std::swap(t[2], t[3]);
          mesh.tetrahedra.push_back(t);
        }
      }
  mesh.label.assign(mesh.tetrahedra.size(), 0);
  return mesh;
}

std::vector<int> nodes_at(const TetMesh& mesh, int axis, double value) {
  std::vector<int> nodes;
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n)
    if (std::abs(mesh.nodes_mm[n][axis] - value) < 1e-9) nodes.push_back(static_cast<int>(n));
  return nodes;
}

}  // namespace palpate::test
