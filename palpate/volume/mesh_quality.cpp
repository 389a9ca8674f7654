#include "palpate/volume/mesh_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "palpate/volume/tetrahedralize.h"

namespace palpate {

double smallest_dihedral_deg(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  if (!(signed_volume_mm3(a, b, c, d) > 0)) return 0;
  const std::array<Vec3, 4> inwards = {(d - b).cross(c - b).normalized(), (c - a).cross(d - a).normalized(),
                                       (d - a).cross(b - a).normalized(), (b - a).cross(c - a).normalized()};
  double max = -1;
  for (size_t i = 0; i < 4; ++i)
    for (size_t j = i + 1; j < 4; ++j) max = std::max(max, -inwards[i].dot(inwards[j]));
  return std::acos(std::clamp(max, -1.0, 1.0)) * 180 / std::numbers::pi;
}

double smallest_dihedral_deg(const TetMesh& mesh) {
  double min = 180;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const auto node = [&](size_t k) -> const Vec3& { return mesh.nodes_mm[static_cast<size_t>(t[k])]; };
    min = std::min(min, smallest_dihedral_deg(node(0), node(1), node(2), node(3)));
  }
  return mesh.tetrahedra.empty() ? 0 : min;
}

namespace {

bool contains(const Tetrahedron& t, int node) {
  return std::find(t.begin(), t.end(), node) != t.end();
}

/// Of the tetrahedra around a node or an edge (`middle`), those outside the largest group that hangs together over
/// faces with `middle`.
std::vector<int> smaller_groups(const TetMesh& mesh, std::vector<int> around, const std::vector<int>& middle) {
  const auto share_face = [&](int s, int t) {
    const Tetrahedron &a = mesh.tetrahedra[static_cast<size_t>(s)], &b = mesh.tetrahedra[static_cast<size_t>(t)];
    const auto shared = std::count_if(a.begin(), a.end(), [&](int node) { return contains(b, node); });
    return shared == 3 &&
           std::all_of(middle.begin(), middle.end(), [&](int node) { return contains(a, node) && contains(b, node); });
  };
  std::vector<int> largest, smaller;
  while (!around.empty()) {
    std::vector<int> group = {around.back()};
    around.pop_back();
    for (size_t head = 0; head < group.size(); ++head) {
      const auto apart =
          std::partition(around.begin(), around.end(), [&](int t) { return !share_face(group[head], t); });
      group.insert(group.end(), apart, around.end());
      around.erase(apart, around.end());
    }
    if (group.size() > largest.size()) std::swap(group, largest);
    smaller.insert(smaller.end(), group.begin(), group.end());
  }
  return smaller;
}

/// Elements that are joined to the rest by a hinge.
std::vector<char> hinged(const TetMesh& mesh) {
  std::vector<std::vector<int>> star(mesh.nodes_mm.size());
  for (size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (int node : mesh.tetrahedra[t]) star[static_cast<size_t>(node)].push_back(static_cast<int>(t));
  std::vector<char> marked(mesh.tetrahedra.size(), 0);
  const auto mark = [&](const std::vector<int>& elements) {
    for (int t : elements) marked[static_cast<size_t>(t)] = 1;
  };
  std::vector<char> on_boundary(mesh.nodes_mm.size(), 0);
  std::vector<std::pair<int, int>> edges;
  for (const Triangle& t : boundary_triangles(mesh))
    for (size_t k = 0; k < 3; ++k) {
      on_boundary[static_cast<size_t>(t[k])] = 1;
      edges.emplace_back(t[k], t[(k + 1) % 3]);
    }
  std::sort(edges.begin(), edges.end());
  for (size_t i = 1; i < edges.size(); ++i) {
    if (edges[i] != edges[i - 1]) continue;
    std::vector<int> around;
    for (int t : star[static_cast<size_t>(edges[i].first)])
      if (contains(mesh.tetrahedra[static_cast<size_t>(t)], edges[i].second)) around.push_back(t);
    mark(smaller_groups(mesh, around, {edges[i].first, edges[i].second}));
  }
  for (size_t node = 0; node < star.size(); ++node)
    if (on_boundary[node]) mark(smaller_groups(mesh, star[node], {static_cast<int>(node)}));
  return marked;
}

/// The largest set of tetrahedra connected over faces; nodes used by none are dropped.
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

}  // namespace

TetMesh without_hinges(const TetMesh& mesh) {
  TetMesh piece = largest_piece(mesh);
  while (true) {
    const std::vector<char> marked = hinged(piece);
    if (std::find(marked.begin(), marked.end(), 1) == marked.end()) return piece;
    TetMesh rest;
    rest.nodes_mm = piece.nodes_mm;
    for (size_t t = 0; t < marked.size(); ++t) {
      if (marked[t]) continue;
      rest.tetrahedra.push_back(piece.tetrahedra[t]);
      rest.label.push_back(piece.label[t]);
    }
    piece = largest_piece(rest);
  }
}

}  // namespace palpate
