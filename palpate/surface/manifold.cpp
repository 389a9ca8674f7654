#include "palpate/surface/manifold.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

namespace palpate {

namespace {

// Below this cosine between normal and viewing ray a triangle is seen edge-on and has no camera side.
constexpr double kEdgeOn = 0.02;
constexpr double kFlatCosine = -0.5;  // 120 degrees

uint64_t directed(int a, int b) {
  return static_cast<uint64_t>(static_cast<uint32_t>(a)) << 32 | static_cast<uint32_t>(b);
}
uint64_t undirected(int a, int b) {
  return a < b ? directed(a, b) : directed(b, a);
}

/// Triangles by directed edge (a, b): those that run from a to b.
using EdgeMap = std::unordered_map<uint64_t, std::vector<int>>;

class Walk {
 public:
  Walk(const std::vector<Vec3>& points, std::vector<Triangle> triangles)
      : points_(points), triangles_(std::move(triangles)), alive_(triangles_.size(), 1) {
    by_edge_.reserve(triangles_.size() * 3);
    for (size_t t = 0; t < triangles_.size(); ++t)
      for (int k = 0; k < 3; ++k) by_edge_[edge(t, k)].push_back(static_cast<int>(t));
  }

  /// Removes, again and again, triangles with a free edge that hang on a branching edge.
  void prune() {
    std::vector<int> queue(triangles_.size());
    std::iota(queue.begin(), queue.end(), 0);
    while (!queue.empty()) {
      std::vector<int> next;
      for (int t : queue) {
        if (!alive_[static_cast<size_t>(t)] || !is_fin(static_cast<size_t>(t))) continue;
        alive_[static_cast<size_t>(t)] = 0;
        for (int k = 0; k < 3; ++k)
          for (uint64_t e : {edge(static_cast<size_t>(t), k), opposite(static_cast<size_t>(t), k)})
            for (int other : at(e))
              if (alive_[static_cast<size_t>(other)]) next.push_back(other);
      }
      queue = std::move(next);
    }
  }

  std::vector<Triangle> components() {
    std::vector<Triangle> taken;
    // First from triangles without rivals, so that the walk starts on sure ground.
    for (bool sure : {true, false})
      for (size_t seed = 0; seed < triangles_.size(); ++seed)
        if (alive_[seed] && (!sure || has_no_rival(seed))) walk_from(seed, taken);
    return taken;
  }

 private:
  uint64_t edge(size_t t, int k) const {
    return directed(triangles_[t][static_cast<size_t>(k)], triangles_[t][static_cast<size_t>((k + 1) % 3)]);
  }
  uint64_t opposite(size_t t, int k) const {
    return directed(triangles_[t][static_cast<size_t>((k + 1) % 3)], triangles_[t][static_cast<size_t>(k)]);
  }

  const std::vector<int>& at(uint64_t e) const {
    static const std::vector<int> kNone;
    const auto found = by_edge_.find(e);
    return found == by_edge_.end() ? kNone : found->second;
  }

  int alive_at(uint64_t e) const {
    return static_cast<int>(
        std::count_if(at(e).begin(), at(e).end(), [&](int t) { return alive_[static_cast<size_t>(t)] != 0; }));
  }

  bool is_fin(size_t t) const {
    bool is_free = false, branches = false;
    for (int k = 0; k < 3; ++k) {
      const int same = alive_at(edge(t, k)), across = alive_at(opposite(t, k));
      is_free |= same == 1 && across == 0;
      branches |= same + across > 2;
    }
    return is_free && branches;
  }

  bool has_no_rival(size_t t) const {
    for (int k = 0; k < 3; ++k)
      if (alive_at(edge(t, k)) != 1 || alive_at(opposite(t, k)) > 1) return false;
    return true;
  }

  bool fits(size_t t) const {
    for (int k = 0; k < 3; ++k)
      if (used_.count(edge(t, k))) return false;
    return true;
  }

  Vec3 unit_normal(size_t t) const {
    const auto& [a, b, c] = triangles_[t];
    return (point(b) - point(a)).cross(point(c) - point(a)).normalized();
  }

  const Vec3& point(int i) const { return points_[static_cast<size_t>(i)]; }

  /// How far triangle `next` across edge k of `t` leans towards the camera side of `t`: sine-like, rising from -1
  /// (folded back below) through 0 (flat) to 1 (folded back above); beyond a right angle it is no continuation.
  bool leans(size_t t, int k, size_t next, double& angle) const {
    const Vec3 &a = point(triangles_[t][static_cast<size_t>(k)]),
               &b = point(triangles_[t][static_cast<size_t>((k + 1) % 3)]);
    const Vec3 along = (b - a).normalized();
    const Vec3 normal = unit_normal(t), outwards = along.cross(normal);
    int apex = -1;
    for (int corner : triangles_[next])
      if (corner != triangles_[t][static_cast<size_t>(k)] && corner != triangles_[t][static_cast<size_t>((k + 1) % 3)])
        apex = corner;
    const Vec3 to_apex = point(apex) - a;
    angle = std::atan2(to_apex.dot(normal), to_apex.dot(outwards));
    return std::abs(angle) < 1.7;
  }

  void walk_from(size_t seed, std::vector<Triangle>& taken) {
    if (!fits(seed)) return;
    std::vector<size_t> queue;
    const auto take = [&](size_t t) {
      alive_[t] = 0;
      for (int k = 0; k < 3; ++k) used_.insert(edge(t, k));
      taken.push_back(triangles_[t]);
      queue.push_back(t);
    };
    take(seed);
    for (size_t head = 0; head < queue.size(); ++head) {
      const size_t t = queue[head];
      for (int k = 0; k < 3; ++k) {
        int best = -1;
        double best_angle = 0;
        for (int next : at(opposite(t, k))) {
          double angle = 0;
          const auto candidate = static_cast<size_t>(next);
          if (!alive_[candidate] || !fits(candidate) || !leans(t, k, candidate, angle)) continue;
          if (best < 0 || angle > best_angle) best = next, best_angle = angle;
        }
        if (best >= 0) take(static_cast<size_t>(best));
      }
    }
  }

  const std::vector<Vec3>& points_;
  std::vector<Triangle> triangles_;
  std::vector<char> alive_;
  EdgeMap by_edge_;
  std::unordered_set<uint64_t> used_;
};

/// The largest set of triangles connected over edges (`over_edges`), in their order.
std::vector<Triangle> largest_component(const std::vector<Triangle>& triangles) {
  std::vector<int> parent(triangles.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int t) {
    while (parent[static_cast<size_t>(t)] != t)
      t = parent[static_cast<size_t>(t)] = parent[static_cast<size_t>(parent[static_cast<size_t>(t)])];
    return t;
  };
  std::unordered_map<uint64_t, int> first_at;
  for (size_t t = 0; t < triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) {
      const auto [place, is_new] =
          first_at.try_emplace(undirected(triangles[t][k], triangles[t][(k + 1) % 3]), static_cast<int>(t));
      if (!is_new) parent[static_cast<size_t>(root(static_cast<int>(t)))] = root(place->second);
    }
  std::vector<int> size(triangles.size(), 0);
  for (size_t t = 0; t < triangles.size(); ++t) ++size[static_cast<size_t>(root(static_cast<int>(t)))];
  const auto largest = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<Triangle> result;
  for (size_t t = 0; t < triangles.size(); ++t)
    if (root(static_cast<int>(t)) == largest) result.push_back(triangles[t]);
  return result;
}

/// Where several fans of triangles meet in one vertex only the largest stays. Returns whether anything was removed.
bool remove_smaller_fans(size_t points, std::vector<Triangle>& triangles) {
  std::vector<std::vector<int>> star(points);
  for (size_t t = 0; t < triangles.size(); ++t)
    for (int corner : triangles[t]) star[static_cast<size_t>(corner)].push_back(static_cast<int>(t));
  std::vector<char> removed(triangles.size(), 0);
  const auto share_edge_at = [&](int s, int t, int vertex) {
    for (int a : triangles[static_cast<size_t>(s)])
      for (int b : triangles[static_cast<size_t>(t)])
        if (a == b && a != vertex) return true;
    return false;
  };
  for (size_t v = 0; v < points; ++v) {
    std::vector<int> left = star[v], best;
    while (!left.empty()) {
      std::vector<int> fan = {left.back()};
      left.pop_back();
      for (size_t head = 0; head < fan.size(); ++head)
        for (size_t i = 0; i < left.size();)
          if (share_edge_at(fan[head], left[i], static_cast<int>(v))) {
            fan.push_back(left[i]);
            left[i] = left.back();
            left.pop_back();
          } else {
            ++i;
          }
      if (fan.size() > best.size()) std::swap(fan, best);
      for (int t : fan) removed[static_cast<size_t>(t)] = 1;
    }
  }
  size_t kept = 0;
  for (size_t t = 0; t < triangles.size(); ++t)
    if (!removed[t]) triangles[kept++] = triangles[t];
  const bool any = kept < triangles.size();
  triangles.resize(kept);
  return any;
}

/// Flat triangles whose longest side lies on the rim: they add nothing but a bad normal. Taking one away frees its
/// third corner, which therefore must not lie on the rim already. Returns whether anything was removed.
bool trim_rim(const std::vector<Vec3>& points, std::vector<Triangle>& triangles) {
  std::unordered_set<uint64_t> edges;
  for (const Triangle& t : triangles)
    for (size_t k = 0; k < 3; ++k) edges.insert(directed(t[k], t[(k + 1) % 3]));
  std::vector<char> on_rim(points.size(), 0);
  const auto is_open = [&](int a, int b) { return !edges.count(directed(b, a)); };
  for (const Triangle& t : triangles)
    for (size_t k = 0; k < 3; ++k)
      if (is_open(t[k], t[(k + 1) % 3]))
        on_rim[static_cast<size_t>(t[k])] = on_rim[static_cast<size_t>(t[(k + 1) % 3])] = 1;
  size_t kept = 0;
  for (const Triangle& t : triangles) {
    bool is_flat = false;
    for (size_t k = 0; k < 3 && !is_flat; ++k) {
      const int a = t[k], b = t[(k + 1) % 3], apex = t[(k + 2) % 3];
      if (!is_open(a, b) || on_rim[static_cast<size_t>(apex)]) continue;
      const Vec3 to_a = (points[static_cast<size_t>(a)] - points[static_cast<size_t>(apex)]).normalized(),
                 to_b = (points[static_cast<size_t>(b)] - points[static_cast<size_t>(apex)]).normalized();
      is_flat = to_a.dot(to_b) < kFlatCosine;
      if (is_flat) on_rim[static_cast<size_t>(apex)] = 1;
    }
    if (!is_flat) triangles[kept++] = t;
  }
  const bool any = kept < triangles.size();
  triangles.resize(kept);
  return any;
}

}  // namespace

std::vector<Triangle> extract_manifold(const std::vector<Vec3>& points_mm, const std::vector<Triangle>& candidates) {
  std::vector<Triangle> facing;
  for (Triangle t : candidates) {
    const Vec3 &a = points_mm[static_cast<size_t>(t[0])], &b = points_mm[static_cast<size_t>(t[1])],
               &c = points_mm[static_cast<size_t>(t[2])];
    const Vec3 normal = (b - a).cross(c - a), ray = a + b + c;
    const double cosine = normal.dot(ray) / (normal.norm() * ray.norm());
    if (!(std::abs(cosine) > kEdgeOn)) continue;
    if (cosine > 0) std::swap(t[1], t[2]);
    facing.push_back(t);
  }
  // The order and turn of facets inside CGAL's triangulation follow addresses, which differ from run to run.
  for (Triangle& t : facing) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(facing.begin(), facing.end());
  Walk walk(points_mm, std::move(facing));
  walk.prune();
  std::vector<Triangle> triangles = walk.components();
  do triangles = largest_component(triangles);
  while (remove_smaller_fans(points_mm.size(), triangles));
  while (trim_rim(points_mm, triangles)) {
  }
  return triangles;
}

}  // namespace palpate
