#include "bench/accuracy/surface_tables.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "bench/accuracy/peer_surfaces.h"
#include "palpate/core/stopwatch.h"
#include "palpate/surface/cocone.h"
#include "tests/surface/seen_surface.h"

namespace palpate {

namespace {

using namespace palpate::test;

constexpr double kSpacing_mm = 1.5;
constexpr double kSeenCosine = 0.35;  // steeper than 70 degrees to the viewing ray nothing is compared

struct Figures {
  double distance_mm = 0;  ///< root mean square over the area
  double angle_deg = 0;    ///< of triangle normals, root mean square over the area
  double hole_mm = 0;      ///< distance where nothing was measured; NaN where nothing is
  double missing_pct = 0;  ///< of what the camera saw
  double time_ms = 0;
  std::string topology;
};

double seen_cosine(const TrueSurface& truth, const Vec3& p) {
  return -truth.normal(p).dot(p.normalized());
}

int euler_number(const Surface& surface) {
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : surface.triangles)
    for (size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  return static_cast<int>(surface.vertices_mm.size()) - static_cast<int>(edges.size()) +
         static_cast<int>(surface.triangles.size());
}

std::string topology_of(const Surface& surface, int expected_euler) {
  if (const std::string fault = topology_fault(surface); !fault.empty()) return fault;
  const int euler = euler_number(surface);
  return euler == expected_euler ? "right" : fmt::format("Euler number {} instead of {}", euler, expected_euler);
}

Figures judge(const TrueSurface& truth, const View& view, const Surface& surface, const std::vector<Vec3>& seen) {
  Figures figures;
  double area = 0, distance = 0, angle = 0, hole_area = 0, hole_distance = 0;
  std::vector<Vec3> samples;
  for (const Triangle& t : surface.triangles) {
    const Vec3 corners[3] = {surface.vertices_mm[static_cast<size_t>(t[0])],
                             surface.vertices_mm[static_cast<size_t>(t[1])],
                             surface.vertices_mm[static_cast<size_t>(t[2])]};
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    const Vec3 doubled = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (!(doubled.norm() > 0) || seen_cosine(truth, middle) < kSeenCosine) continue;
    for (const Vec3& corner : corners) samples.push_back((2 * middle + corner) / 3);
    double squared = 0;
    for (size_t k = 0; k < 3; ++k)
      squared += doubled.norm() / 3 * std::pow(truth.distance_mm(samples[samples.size() - 1 - k]), 2);
    if ((middle - view.hole_center_mm).norm() < view.hole_radius_mm) {
      hole_area += doubled.norm();
      hole_distance += squared;
      continue;
    }
    const double cosine = std::clamp(doubled.normalized().dot(truth.normal(middle)), -1.0, 1.0);
    area += doubled.norm();
    angle += doubled.norm() * std::pow(std::acos(cosine), 2);
    distance += squared;
  }
  figures.hole_mm = std::sqrt(hole_distance / hole_area);
  figures.distance_mm = std::sqrt(distance / area);
  figures.angle_deg = std::sqrt(angle / area) * 180 / std::numbers::pi;
  int missing = 0;
  for (const Vec3& p : seen)
    missing += std::none_of(samples.begin(), samples.end(),
                            [&](const Vec3& s) { return (s - p).squaredNorm() < kSpacing_mm * kSpacing_mm; });
  figures.missing_pct = 100.0 * missing / static_cast<double>(seen.size());
  return figures;
}

/// Turned over where most of it looks away from the camera: the peers do not know where the camera is.
Surface towards_camera(Surface surface) {
  if (share_facing_away(surface) > 0.5)
    for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
  return surface;
}

struct Sampling {
  std::string name;
  View view;
};

std::vector<Sampling> samplings() {
  std::vector<Sampling> all(4);
  all[0].name = "clean";
  all[1].name = "0.5 mm noise";
  all[1].view.noise_mm = 0.5;
  all[2].name = "0.5 mm noise, 5 % outliers";
  all[2].view.noise_mm = 0.5;
  all[2].view.outlier_share = 0.05;
  all[3].name = "0.5 mm noise, hole of 10 mm";
  all[3].view.noise_mm = 0.5;
  all[3].view.hole_center_mm = {3, -4, 0};
  all[3].view.hole_radius_mm = 5;
  return all;
}

/// Points that the camera saw, where they truly are; also in the hole, which is to be closed.
std::vector<Vec3> truly_seen(const TrueSurface& truth) {
  View view;
  view.step_px = 8;
  std::vector<Vec3> seen;
  for (const Vec3& p : look_at(truth, view).position_mm)
    if (seen_cosine(truth, p) > 1.3 * kSeenCosine) seen.push_back(p);
  return seen;
}

}  // namespace

std::string surface_accuracy_table() {
  std::string table =
      "| surface, points | way | distance mm | normals deg | in the hole mm | not covered % | topology | ms |\n"
      "|---|---|---|---|---|---|---|---|\n"
      "| goal | ours | <= the best of the others | <= the best of the others | | 0 | right | |\n";
  for (const TrueSurface& truth : {sphere_cap(), saddle(), torus_patch(), bumpy_organ()})
    for (Sampling sampling : samplings()) {
      if (sampling.view.hole_radius_mm > 0) {
        // The hole lies on the surface, on the ray through (20, -30) px.
        View one;
        one.half_width_px = one.half_height_px = 40;
        one.step_px = 40;
        sampling.view.hole_center_mm = look_at(truth, one).position_mm.front();
      }
      const PointCloud cloud = look_at(truth, sampling.view);
      const std::vector<Vec3> seen = truly_seen(truth);
      const int euler = truth.name == "torus patch" ? 0 : 1;
      const auto add = [&](const std::string& way, const std::function<Surface()>& reconstruct, double before_ms) {
        Stopwatch watch;
        const Surface surface = towards_camera(reconstruct());
        const double time_ms = before_ms + watch.lap_ms();
        const Figures figures = judge(truth, sampling.view, surface, seen);
        table += fmt::format("| {}, {} | {} | {:.3f} | {:.2f} | {} | {:.1f} | {} | {:.0f} |\n", truth.name,
                             sampling.name, way, figures.distance_mm, figures.angle_deg,
                             std::isfinite(figures.hole_mm) ? fmt::format("{:.2f}", figures.hole_mm) : "",
                             figures.missing_pct, topology_of(surface, euler), time_ms);
      };
      add(
          "ours", [&] { return cocone(clean_points(cloud, kSpacing_mm, {}).position_mm, {}); }, 0);
      Stopwatch watch;
      const std::vector<Vec3> tidy = peer::tidied(cloud.position_mm, kSpacing_mm);
      const double tidy_ms = watch.lap_ms();
      const std::vector<Vec3> clean = clean_points(cloud, kSpacing_mm, {}).position_mm;
      const double clean_ms = watch.lap_ms();
      const auto add_fronts = [&](const std::string& suffix, const std::vector<Vec3>& points, double before_ms) {
        add(
            "advancing front" + suffix, [&] { return peer::advancing_front(points, kSpacing_mm); }, before_ms);
        add(
            "scale space" + suffix, [&] { return peer::scale_space(points, kSpacing_mm); }, before_ms);
      };
      add_fronts("", tidy, tidy_ms);
      add(
          "Poisson", [&] { return peer::poisson(tidy, kSpacing_mm); }, tidy_ms);
      add_fronts(" on our points", clean, clean_ms);
    }
  return table;
}

std::string surface_time_table() {
  std::string table = "| points | clean_points ms (from the dense cloud) | cocone ms | goal ms |\n|---|---|---|---|\n";
  const PointCloud cloud = look_at(bumpy_organ(), samplings()[1].view);
  for (const auto& [wanted, goal_ms] : {std::pair{5000, 150}, std::pair{20000, 700}}) {
    double spacing_mm = 1;
    for (int i = 0; i < 4; ++i)
      spacing_mm *= std::sqrt(static_cast<double>(clean_points(cloud, spacing_mm, {}).size()) / wanted);
    std::vector<double> clean_ms, cocone_ms;
    size_t points = 0;
    for (int i = 0; i < 5; ++i) {
      Stopwatch watch;
      const PointCloud clean = clean_points(cloud, spacing_mm, {});
      clean_ms.push_back(watch.lap_ms());
      cocone(clean.position_mm, {});
      cocone_ms.push_back(watch.lap_ms());
      points = clean.size();
    }
    std::sort(clean_ms.begin(), clean_ms.end());
    std::sort(cocone_ms.begin(), cocone_ms.end());
    table += fmt::format("| {} | {:.0f} (of {}) | {:.0f} | <= {} |\n", points, clean_ms[2], cloud.size(), cocone_ms[2],
                         goal_ms);
  }
  return table;
}

}  // namespace palpate
