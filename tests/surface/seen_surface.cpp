#include "tests/surface/seen_surface.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

namespace palpate::test {

Vec3 TrueSurface::normal(const Vec3& p) const {
  const double h = 1e-4;
  Vec3 gradient;
  for (int i = 0; i < 3; ++i) gradient[i] = (value(p + h * Vec3::Unit(i)) - value(p - h * Vec3::Unit(i))) / (2 * h);
  return gradient.normalized();
}

double TrueSurface::distance_mm(const Vec3& p) const {
  const double h = 1e-4;
  Vec3 gradient;
  for (int i = 0; i < 3; ++i) gradient[i] = (value(p + h * Vec3::Unit(i)) - value(p - h * Vec3::Unit(i))) / (2 * h);
  return std::abs(value(p)) / gradient.norm();
}

TrueSurface sphere_cap() {
  return {"sphere cap", [](const Vec3& p) { return (p - Vec3(3, -4, 110)).norm() - 30; }};
}

TrueSurface saddle() {
  return {"saddle", [](const Vec3& p) { return 100 + (p.x() * p.x() - p.y() * p.y()) / 80 - p.z(); }};
}

TrueSurface torus_patch() {
  return {"torus patch", [](const Vec3& p) {
            const Vec3 q = Eigen::AngleAxisd(0.5, Vec3::UnitX()) * (p - Vec3(0, 0, 110));
            return std::hypot(std::hypot(q.x(), q.y()) - 30, q.z()) - 12;
          }};
}

TrueSurface bumpy_organ() {
  return {"bumpy organ", [](const Vec3& p) {
            const Vec3 q = p - Vec3(0, 0, 115);
            const double wave = 2 * M_PI / 14;
            return (Vec3(q.x() / 32, q.y() / 26, q.z() / 22).norm() - 1) * 22 -
                   0.4 * (std::sin(wave * p.x()) + std::sin(wave * p.y()));
          }};
}

TrueSurface ball_before_wall() {
  return {"ball before a wall", [](const Vec3& p) { return std::min((p - Vec3(0, 0, 85)).norm() - 18, 125 - p.z()); }};
}

namespace {

/// Depth along a viewing ray (z = 1), 0 where nothing is hit.
double depth_mm(const TrueSurface& surface, const Vec3& ray) {
  double outside = 60, inside = 0;
  for (double z = outside; z < 140 && inside == 0; z += 1) (surface.value(ray * z) < 0 ? inside : outside) = z;
  if (inside == 0) return 0;
  for (int i = 0; i < 30; ++i) {
    const double z = (inside + outside) / 2;
    (surface.value(ray * z) < 0 ? inside : outside) = z;
  }
  return (inside + outside) / 2;
}

}  // namespace

PointCloud look_at(const TrueSurface& surface, const View& view) {
  std::mt19937 random(view.seed);
  std::normal_distribution<double> noise(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  PointCloud cloud;
  for (int v = -view.half_height_px; v <= view.half_height_px; v += view.step_px) {
    for (int u = -view.half_width_px; u <= view.half_width_px; u += view.step_px) {
      const auto ray_at = [&](double du) { return Vec3((u + du) / view.focal_px, v / view.focal_px, 1); };
      const Vec3 ray = ray_at(0);
      double truth = depth_mm(surface, ray);
      if (truth == 0) continue;
      if (view.ramp_px > 0) {
        const double left = depth_mm(surface, ray_at(-0.5 * view.ramp_px)),
                     right = depth_mm(surface, ray_at(0.5 * view.ramp_px));
        if (left > 0 && right > 0 && std::abs(left - right) > 5) truth = left + (right - left) * uniform(random);
      }
      if ((ray * truth - view.hole_center_mm).norm() < view.hole_radius_mm) continue;
      double z = truth + view.noise_mm * noise(random);
      if (uniform(random) < view.outlier_share) z = truth + 40 * (uniform(random) - 0.5);
      cloud.position_mm.push_back(ray * z);
      cloud.depth_deviation_mm.push_back(static_cast<float>(std::max(view.noise_mm, 0.05)));
      cloud.correlation.push_back(0.9f);
      cloud.colour.emplace_back(60, 70, 160);
    }
  }
  return cloud;
}

double rms_distance_mm(const TrueSurface& truth, const std::vector<Vec3>& points) {
  double sum = 0;
  for (const Vec3& p : points) sum += std::pow(truth.distance_mm(p), 2);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

namespace {

std::map<std::pair<int, int>, int> directed_edges(const Surface& surface) {
  std::map<std::pair<int, int>, int> count;
  for (const Triangle& t : surface.triangles)
    for (size_t k = 0; k < 3; ++k) ++count[{t[k], t[(k + 1) % 3]}];
  return count;
}

}  // namespace

std::string topology_fault(const Surface& surface) {
  if (surface.triangles.empty()) return "no triangles";
  const auto edges = directed_edges(surface);
  for (const auto& [edge, count] : edges)
    if (count > 1) return "an edge is used twice in one direction";
  std::vector<int> parent(surface.vertices_mm.size());
  std::iota(parent.begin(), parent.end(), 0);
  const std::function<int(int)> root = [&](int i) {
    return parent[static_cast<size_t>(i)] == i ? i
                                               : parent[static_cast<size_t>(i)] = root(parent[static_cast<size_t>(i)]);
  };
  for (const auto& [edge, count] : edges) parent[static_cast<size_t>(root(edge.first))] = root(edge.second);
  std::set<int> roots;
  for (size_t i = 0; i < parent.size(); ++i) roots.insert(root(static_cast<int>(i)));
  if (roots.size() != 1) return std::to_string(roots.size()) + " components";
  return "";
}

int boundary_loops(const Surface& surface) {
  const auto edges = directed_edges(surface);
  std::map<int, int> next;
  for (const auto& [edge, count] : edges)
    if (!edges.count({edge.second, edge.first})) next[edge.second] = edge.first;
  int loops = 0;
  while (!next.empty()) {
    ++loops;
    for (auto place = next.begin(); place != next.end();) {
      const int to = place->second;
      next.erase(place);
      place = next.find(to);
    }
  }
  return loops;
}

double fraction_facing_away(const Surface& surface) {
  int away = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3 &a = surface.vertices_mm[static_cast<size_t>(t[0])], &b = surface.vertices_mm[static_cast<size_t>(t[1])],
               &c = surface.vertices_mm[static_cast<size_t>(t[2])];
    away += (b - a).cross(c - a).dot(a + b + c) >= 0;
  }
  return away / static_cast<double>(surface.triangles.size());
}

}  // namespace palpate::test
