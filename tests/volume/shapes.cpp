#include "tests/volume/shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace palpate::test {

Surface ellipsoid(const Vec3& center_mm, const Vec3& half_axes_mm, int level) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Surface s;
  s.vertices_mm = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  s.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Vec3& v : s.vertices_mm) v.normalize();
  for (int i = 0; i < level; ++i) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(s.vertices_mm.size()));
      if (is_new)
        s.vertices_mm.push_back(
            (s.vertices_mm[static_cast<size_t>(a)] + s.vertices_mm[static_cast<size_t>(b)]).normalized());
      return place->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : s.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    s.triangles = std::move(finer);
  }
  for (Vec3& v : s.vertices_mm) v = center_mm + v.cwiseProduct(half_axes_mm);
  return s;
}

Surface box(const Vec3& min_mm, const Vec3& max_mm) {
  Surface s;
  for (int corner = 0; corner < 8; ++corner)
    s.vertices_mm.emplace_back(corner & 1 ? max_mm.x() : min_mm.x(), corner & 2 ? max_mm.y() : min_mm.y(),
                               corner & 4 ? max_mm.z() : min_mm.z());
  s.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return s;
}

TetMesh block(const Vec3& min_mm, double edge_mm, int n) {
  TetMesh mesh;
  const auto node = [n](int x, int y, int z) { return (z * (n + 1) + y) * (n + 1) + x; };
  for (int z = 0; z <= n; ++z)
    for (int y = 0; y <= n; ++y)
      for (int x = 0; x <= n; ++x) mesh.nodes_mm.push_back(min_mm + edge_mm / n * Vec3(x, y, z));
  const int steps[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        for (int path = 0; path < 6; ++path) {
          int at[3] = {x, y, z};
          Tetrahedron t = {node(x, y, z), 0, 0, 0};
          for (size_t k = 0; k < 3; ++k) {
            ++at[steps[path][k]];
            t[k + 1] = node(at[0], at[1], at[2]);
          }
          if (path >= 3) std::swap(t[1], t[2]);
          mesh.tetrahedra.push_back(t);
        }
  mesh.label.assign(mesh.tetrahedra.size(), 0);
  return mesh;
}

namespace {

double volume(const TetMesh& mesh, const Tetrahedron& t) {
  const auto node = [&](size_t k) -> const Vec3& { return mesh.nodes_mm[static_cast<size_t>(t[k])]; };
  return signed_volume_mm3(node(0), node(1), node(2), node(3));
}

}  // namespace

double total_volume_mm3(const TetMesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) sum += volume(mesh, t);
  return sum;
}

double smallest_volume_mm3(const TetMesh& mesh) {
  double min = 1e300;
  for (const Tetrahedron& t : mesh.tetrahedra) min = std::min(min, volume(mesh, t));
  return min;
}

std::string boundary_fault(const TetMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const Triangle& t : boundary_triangles(mesh))
    for (size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    if (count != 1) return "an edge is used twice in one direction";
    if (!edges.count({edge.second, edge.first})) return "an edge is used once";
  }
  return "";
}

double rms_distance_mm(const std::vector<Vec3>& points, const TetMesh& mesh) {
  const std::vector<Triangle> boundary = boundary_triangles(mesh);
  double sum = 0;
  for (const Vec3& p : points) sum += std::pow(closest_point(p, mesh.nodes_mm, boundary).distance, 2);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

}  // namespace palpate::test
