#include "palpate/surface/extend_rim.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

/// Points beside a vertex of the rim that tell how far the surface goes on: so many at least, and so far along the rim.
constexpr size_t kMinPoints = 12;
constexpr double kAlongFraction = 0.35;
/// Of the points outside, the outermost are noise.
constexpr double kEndFraction = 0.95;
/// The last stretch of them tells how the surface bends there.
constexpr double kLastStretch = 0.7;
constexpr double kMaxBendFraction = 0.5;
/// Times that a step which crosses an edge is halved, the last time to nothing.
constexpr int kShortened = 4;

const Vec3& at(const std::vector<Vec3>& values, int i) {
  return values[static_cast<size_t>(i)];
}

/// Outward direction along the surface at each vertex of the rim, not normalised.
std::map<int, Vec3> outward_directions(const Surface& surface) {
  std::map<std::pair<int, int>, size_t> owner;
  for (size_t t = 0; t < surface.triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) owner[{surface.triangles[t][k], surface.triangles[t][(k + 1) % 3]}] = t;
  std::map<int, Vec3> outward;
  for (const auto& [edge, t] : owner) {
    const auto [a, b] = edge;
    if (owner.count({b, a})) continue;
    const Triangle& corners = surface.triangles[t];
    const Vec3& p = at(surface.vertices_mm, corners[0]);
    const Vec3 normal =
        (at(surface.vertices_mm, corners[1]) - p).cross(at(surface.vertices_mm, corners[2]) - p).normalized();
    const Vec3 away = (at(surface.vertices_mm, b) - at(surface.vertices_mm, a)).cross(normal).normalized();
    for (int vertex : {a, b}) outward.try_emplace(vertex, Vec3::Zero()).first->second += away;
  }
  return outward;
}

/// By how much a vertex of the rim moves, from the measured points around it.
Vec3 step_to_the_end(const Vec3& vertex, const Vec3& outward, const Vec3& normal, const std::vector<Vec3>& measured_mm,
                     double reach_mm) {
  const Vec3 along = normal.cross(outward);
  std::vector<std::pair<double, double>> beyond;  // outwards, height
  for (const Vec3& point : measured_mm) {
    const Vec3 offset = point - vertex;
    if (std::abs(offset.z()) > reach_mm || offset.squaredNorm() > reach_mm * reach_mm) continue;
    const double away = offset.dot(outward);
    if (away > 0 && std::abs(offset.dot(along)) < kAlongFraction * reach_mm)
      beyond.emplace_back(away, offset.dot(normal));
  }
  if (beyond.size() < kMinPoints) return Vec3::Zero();
  std::vector<double> away, height;
  for (const auto& [outwards, above] : beyond) away.push_back(outwards);
  const double end_mm = quantile_of(away, kEndFraction);
  for (const auto& [outwards, above] : beyond)
    if (outwards > kLastStretch * end_mm) height.push_back(above);
  const double bend_mm =
      std::clamp(quantile_of(height, 0.5), -kMaxBendFraction * reach_mm, kMaxBendFraction * reach_mm);
  return end_mm * outward + bend_mm * normal;
}

/// Shortens the steps that would draw a face before something else that is seen, as points beyond an edge may lie in
/// the reach of the rim. (Keeping them from every depth edge makes the rim of noisy recordings ragged, which costs the
/// body more than it gains.)
void stay_before_edges(const Surface& surface, const DepthEdges& edges, std::map<int, Vec3>& step_of) {
  const auto moved = [&](int i) -> Vec3 {
    const auto step = step_of.find(i);
    return step == step_of.end() ? at(surface.vertices_mm, i) : (at(surface.vertices_mm, i) + step->second).eval();
  };
  for (int round = 0; round < kShortened; ++round) {
    std::set<int> too_far;
    for (const Triangle& t : surface.triangles)
      for (size_t k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3];
        if ((step_of.count(a) || step_of.count(b)) && shows_another_depth(edges, moved(a), moved(b)))
          too_far.insert({a, b});
      }
    for (const int vertex : too_far)
      if (const auto step = step_of.find(vertex); step != step_of.end())
        step->second *= round + 1 < kShortened ? 0.5 : 0;
  }
}

}  // namespace

Surface extend_rim(Surface surface, const std::vector<Vec3>& measured_mm, double reach_mm, const DepthEdges* edges) {
  const std::map<int, Vec3> outward = outward_directions(surface);
  const std::vector<std::pair<int, Vec3>> rim(outward.begin(), outward.end());
  const std::vector<Vec3> normals = vertex_normals(surface.vertices_mm, surface.triangles);
  std::vector<Vec3> steps(rim.size(), Vec3::Zero());
  tbb::parallel_for(size_t{0}, rim.size(), [&](size_t i) {
    const Vec3& normal = at(normals, rim[i].first);
    const Vec3 tangent = rim[i].second - rim[i].second.dot(normal) * normal;
    if (tangent.norm() < 1e-9) return;
    steps[i] =
        step_to_the_end(at(surface.vertices_mm, rim[i].first), tangent.normalized(), normal, measured_mm, reach_mm);
  });
  std::map<int, Vec3> step_of;
  for (size_t i = 0; i < rim.size(); ++i) step_of[rim[i].first] = steps[i];
  if (edges) stay_before_edges(surface, *edges, step_of);
  for (const auto& [vertex, step] : step_of) surface.vertices_mm[static_cast<size_t>(vertex)] += step;
  return surface;
}

}  // namespace palpate
