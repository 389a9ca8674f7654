#include "palpate/volume/mesh_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "palpate/volume/tetrahedralize.h"

namespace palpate {

namespace {

double largest_dihedral_cosine(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const std::array<Vec3, 4> inwards = {(d - b).cross(c - b).normalized(), (c - a).cross(d - a).normalized(),
                                       (d - a).cross(b - a).normalized(), (b - a).cross(c - a).normalized()};
  double most = -1;
  for (size_t i = 0; i < 4; ++i)
    for (size_t j = i + 1; j < 4; ++j) most = std::max(most, -inwards[i].dot(inwards[j]));
  return most;
}

}  // namespace

double smallest_dihedral_deg(const TetMesh& mesh) {
  double most = -1;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const auto node = [&](size_t k) -> const Vec3& { return mesh.nodes_mm[static_cast<size_t>(t[k])]; };
    most = std::max(most, largest_dihedral_cosine(node(0), node(1), node(2), node(3)));
  }
  return mesh.tetrahedra.empty() ? 0 : std::acos(std::clamp(most, -1.0, 1.0)) * 180 / std::numbers::pi;
}

TetMesh largest_piece(const TetMesh& mesh) {
  struct Face {
    Triangle key;
    int tetrahedron;
  };
  std::vector<Face> faces;
  faces.reserve(mesh.tetrahedra.size() * 4);
  for (size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const Tetrahedron& t = mesh.tetrahedra[i];
    for (Triangle key : {Triangle{t[1], t[2], t[3]}, {t[0], t[2], t[3]}, {t[0], t[1], t[3]}, {t[0], t[1], t[2]}}) {
      std::sort(key.begin(), key.end());
      faces.push_back({key, static_cast<int>(i)});
    }
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.key < b.key; });
  std::vector<int> parent(mesh.tetrahedra.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[static_cast<size_t>(i)] != i)
      i = parent[static_cast<size_t>(i)] = parent[static_cast<size_t>(parent[static_cast<size_t>(i)])];
    return i;
  };
  for (size_t i = 1; i < faces.size(); ++i)
    if (faces[i].key == faces[i - 1].key)
      parent[static_cast<size_t>(root(faces[i].tetrahedron))] = root(faces[i - 1].tetrahedron);
  std::vector<int> size(parent.size(), 0);
  for (size_t i = 0; i < parent.size(); ++i) ++size[static_cast<size_t>(root(static_cast<int>(i)))];
  const auto largest = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());

  TetMesh piece;
  std::vector<int> number(mesh.nodes_mm.size(), -1);
  for (size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    if (root(static_cast<int>(i)) != largest) continue;
    Tetrahedron t = mesh.tetrahedra[i];
    for (int& node : t) {
      int& new_number = number[static_cast<size_t>(node)];
      if (new_number < 0) {
        new_number = static_cast<int>(piece.nodes_mm.size());
        piece.nodes_mm.push_back(mesh.nodes_mm[static_cast<size_t>(node)]);
      }
      node = new_number;
    }
    piece.tetrahedra.push_back(t);
    piece.label.push_back(i < mesh.label.size() ? mesh.label[i] : 0);
  }
  return piece;
}

}  // namespace palpate
