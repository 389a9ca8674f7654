#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "palpate/volume/tetrahedralize.h"

namespace palpate {

namespace {

struct Edge {
  int a = -1, b = -1;
  double squared_length = 0;

  /// A total order, so that ties do not let two neighbours disagree on which of their edges is the longest.
  bool is_shorter_than(const Edge& other) const {
    if (squared_length != other.squared_length) return squared_length < other.squared_length;
    return std::minmax(a, b) < std::minmax(other.a, other.b);
  }
};

class Bisection {
 public:
  explicit Bisection(const TetMesh& mesh) : mesh_(mesh), star_(mesh.nodes_mm.size()) {
    mesh_.label.resize(mesh_.tetrahedra.size(), 0);
    for (size_t t = 0; t < mesh_.tetrahedra.size(); ++t)
      for (int node : mesh_.tetrahedra[t]) star(node).push_back(static_cast<int>(t));
  }

  void refine(const Vec3& center, double radius, double longest_edge) {
    std::vector<int> waiting(mesh_.tetrahedra.size());
    for (size_t t = 0; t < waiting.size(); ++t) waiting[t] = static_cast<int>(waiting.size() - 1 - t);
    while (!waiting.empty()) {
      const int t = waiting.back();
      if (is_too_coarse(t, center, radius, longest_edge))
        split_longest_first(longest_edge_of(t), waiting);
      else
        waiting.pop_back();
    }
  }

  TetMesh take() { return std::move(mesh_); }

 private:
  std::vector<int>& star(int node) { return star_[static_cast<size_t>(node)]; }
  const Vec3& point(int node) const { return mesh_.nodes_mm[static_cast<size_t>(node)]; }
  Tetrahedron& tetrahedron(int t) { return mesh_.tetrahedra[static_cast<size_t>(t)]; }

  Edge longest_edge_of(int t) {
    Edge longest;
    const Tetrahedron& n = tetrahedron(t);
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = i + 1; j < 4; ++j) {
        const Edge edge{n[i], n[j], (point(n[i]) - point(n[j])).squaredNorm()};
        if (longest.a < 0 || longest.is_shorter_than(edge)) longest = edge;
      }
    return longest;
  }

  /// Whether an edge of the tetrahedron that comes within the sphere is longer than wanted.
  bool is_too_coarse(int t, const Vec3& center, double radius, double longest_edge) {
    const Tetrahedron& n = tetrahedron(t);
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = i + 1; j < 4; ++j) {
        const Vec3 &a = point(n[i]), along = point(n[j]) - a;
        const double squared = along.squaredNorm();
        if (squared <= longest_edge * longest_edge) continue;
        const double at = std::clamp((center - a).dot(along) / squared, 0.0, 1.0);
        if ((a + at * along - center).squaredNorm() <= radius * radius) return true;
      }
    return false;
  }

  std::vector<int> around(const Edge& edge) {
    std::vector<int> ring;
    for (int t : star(edge.a))
      if (const Tetrahedron& n = tetrahedron(t); std::find(n.begin(), n.end(), edge.b) != n.end()) ring.push_back(t);
    return ring;
  }

  /// Follows the path of ever longer edges (Rivara) to one that is the longest of all tetrahedra around it, and bisects
  /// that; only edges that are the longest in all their tetrahedra are ever cut, which keeps angles from degenerating.
  void split_longest_first(Edge edge, std::vector<int>& waiting) {
    for (bool is_longest = false; !is_longest;) {
      is_longest = true;
      Edge longest = edge;
      for (int t : around(edge)) {
        const Edge other = longest_edge_of(t);
        if (longest.is_shorter_than(other)) longest = other;
      }
      if (edge.is_shorter_than(longest)) {
        edge = longest;
        is_longest = false;
      }
    }
    bisect(edge, waiting);
  }

  void bisect(const Edge& edge, std::vector<int>& waiting) {
    const int middle = static_cast<int>(mesh_.nodes_mm.size());
    mesh_.nodes_mm.push_back((point(edge.a) + point(edge.b)) / 2);
    star_.emplace_back();
    for (int t : around(edge)) {
      const int half = static_cast<int>(mesh_.tetrahedra.size());
      mesh_.tetrahedra.push_back(tetrahedron(t));
      mesh_.label.push_back(mesh_.label[static_cast<size_t>(t)]);
      std::replace(tetrahedron(t).begin(), tetrahedron(t).end(), edge.b, middle);
      std::replace(tetrahedron(half).begin(), tetrahedron(half).end(), edge.a, middle);
      std::erase(star(edge.b), t);
      star(middle).push_back(t);
      for (int node : tetrahedron(half)) star(node).push_back(half);
      waiting.push_back(t);
      waiting.push_back(half);
    }
  }

  TetMesh mesh_;
  std::vector<std::vector<int>> star_;  ///< tetrahedra at each node
};

}  // namespace

TetMesh refine_near(const TetMesh& mesh, const Vec3& center_mm, double radius_mm, double edge_mm) {
  Bisection bisection(mesh);
  if (edge_mm > 0) bisection.refine(center_mm, radius_mm, edge_mm);
  return bisection.take();
}

}  // namespace palpate
