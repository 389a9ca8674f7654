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

bool has_right_topology(const Surface& surface, int euler) {
  return topology_fault(surface).empty() && euler_number(surface) == euler;
}

Figures judge(const TrueSurface& truth, const View& view, const Surface& surface, const std::vector<Vec3>& seen) {
  Figures figures;
  double area = 0, distance = 0, angle = 0, hole_area = 0, hole_distance = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3 corners[3] = {surface.vertices_mm[static_cast<size_t>(t[0])],
                             surface.vertices_mm[static_cast<size_t>(t[1])],
                             surface.vertices_mm[static_cast<size_t>(t[2])]};
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    const Vec3 doubled = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (!(doubled.norm() > 0) || seen_cosine(truth, middle) < kSeenCosine) continue;
    double squared = 0;
    for (const Vec3& corner : corners)
      squared += doubled.norm() / 3 * std::pow(truth.distance_mm((2 * middle + corner) / 3), 2);
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
    missing += !(closest_point(p, surface.vertices_mm, surface.triangles).distance < kSpacing_mm);
  figures.missing_pct = 100.0 * missing / static_cast<double>(seen.size());
  return figures;
}

/// Turned over where most of it looks away from the camera: the peers do not know where the camera is.
Surface towards_camera(Surface surface) {
  if (fraction_facing_away(surface) > 0.5)
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
      "| surface, points | ours | advancing front | scale space | Poisson | advancing front, our points | scale space, "
      "our points | ours in the hole, mm |\n|---|---|---|---|---|---|---|---|\n"
      "| goal | <= the best of the others | | | | | | |\n";
  for (const TrueSurface& truth : {sphere_cap(), saddle(), torus_patch(), bumpy_organ()})
    for (Sampling sampling : samplings()) {
      const std::vector<Vec3> seen = truly_seen(truth);
      if (sampling.view.hole_radius_mm > 0)
        sampling.view.hole_center_mm = *std::max_element(seen.begin(), seen.end(), [&](const Vec3& p, const Vec3& q) {
          return seen_cosine(truth, p) < seen_cosine(truth, q);
        });
      table += fmt::format("| {}, {} |", truth.name, sampling.name);
      fmt::print(stderr, "{}, {}\n", truth.name, sampling.name);
      const PointCloud cloud = look_at(truth, sampling.view);
      const int euler = truth.name == "torus patch" ? 0 : 1;
      std::string in_hole;
      const auto add = [&](const Surface& reconstructed) {
        const Surface surface = towards_camera(reconstructed);
        const Figures figures = judge(truth, sampling.view, surface, seen);
        table += fmt::format(" {:.3f} / {:.2f}{}{} |", figures.distance_mm, figures.angle_deg,
                             figures.missing_pct < 1 ? "" : fmt::format(", {:.0f} % open", figures.missing_pct),
                             has_right_topology(surface, euler) ? "" : ", topology");
        if (in_hole.empty())
          in_hole = std::isfinite(figures.hole_mm) ? fmt::format(" {:.2f} |\n", figures.hole_mm) : " |\n";
      };
      const std::vector<Vec3> clean = clean_points(cloud, kSpacing_mm, {}).position_mm;
      add(cocone(clean, {}));
      const std::vector<Vec3> tidy = peer::tidied(cloud.position_mm, kSpacing_mm);
      add(peer::advancing_front(tidy, kSpacing_mm));
      add(peer::scale_space(tidy, kSpacing_mm));
      // On the other two CGAL's surface mesher stops with an assertion or does not come to an end.
      if (truth.name == "sphere cap" || truth.name == "bumpy organ")
        add(peer::poisson(tidy, kSpacing_mm));
      else
        table += " |";
      add(peer::advancing_front(clean, kSpacing_mm));
      add(peer::scale_space(clean, kSpacing_mm));
      table += in_hole;
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
