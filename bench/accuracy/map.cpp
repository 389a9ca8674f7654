#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <set>

#include "bench/accuracy/edge_scenes.h"
#include "bench/accuracy/surface_tables.h"
#include "bench/page.h"
#include "palpate/core/stopwatch.h"
#include "palpate/estimate/scene.h"
#include "palpate/surface/cocone.h"
#include "tests/support/reference_data.h"
#include "tests/surface/seen_surface.h"

// The build stage against what is known: surfaces in closed form, counts and angles of the volume, and Phi as a whole.
//   bench_map                      prints the tables
//   bench_map docs/map.md          and writes them into the page, between its two markers
//   bench_map --only surface       one part of them: surface, times, volume, phi, edges
namespace {

using namespace palpate;

const std::string kBegin = "<!-- tables of bench_map -->\n", kEnd = "<!-- end of the tables -->\n";

/// Middle of each triangle and the points half-way to its corners; at most a few thousand in all.
template <class Wanted>
std::vector<Vec3> samples_of(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles, Wanted wanted) {
  constexpr size_t kMaxSamples = 4000;
  std::vector<Vec3> samples;
  const size_t step = 4 * triangles.size() / kMaxSamples + 1;
  for (size_t i = 0; i < triangles.size(); i += step) {
    const Vec3 &a = vertices[static_cast<size_t>(triangles[i][0])], &b = vertices[static_cast<size_t>(triangles[i][1])],
               &c = vertices[static_cast<size_t>(triangles[i][2])];
    const Vec3 middle = (a + b + c) / 3;
    if (!wanted((b - a).cross(c - a).normalized().dot(middle.normalized()))) continue;
    samples.insert(samples.end(), {middle, (a + middle) / 2, (b + middle) / 2, (c + middle) / 2});
  }
  return samples;
}

bool lies_on_rim(const ClosestPoint& place, const std::vector<Triangle>& triangles,
                 const std::set<std::pair<int, int>>& edges) {
  const Triangle& t = triangles[static_cast<size_t>(place.triangle)];
  for (size_t k = 0; k < 3; ++k)
    if (place.barycentric[static_cast<Eigen::Index>((k + 2) % 3)] < 1e-9 && !edges.count({t[(k + 1) % 3], t[k]}))
      return true;
  return false;
}

/// Root mean square distance of the samples to a triangle mesh; those that are nearest to its rim count if wanted.
double rms_mm(const std::vector<Vec3>& samples, const std::vector<Vec3>& vertices,
              const std::vector<Triangle>& triangles, bool beside_rim) {
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : triangles)
    for (size_t k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
  double sum = 0, count = 0;
  for (const Vec3& p : samples) {
    const ClosestPoint place = closest_point(p, vertices, triangles);
    if (!beside_rim && lies_on_rim(place, triangles, edges)) continue;
    sum += std::pow(place.distance, 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

/// From the faces that look at the camera (within 70 degrees) to S*, where they lie on it and are no wall beneath its
/// rim, and from all of S* to the boundary; root mean squares.
std::string fit_to_surface(const TetMesh& mesh, const Surface& surface) {
  const std::vector<Triangle> boundary = boundary_triangles(mesh);
  const auto looks_at_camera = [](double cosine) { return cosine < -0.35; };
  const auto any = [](double) { return true; };
  return fmt::format(
      "{:.2f} / {:.2f}",
      rms_mm(samples_of(mesh.nodes_mm, boundary, looks_at_camera), surface.vertices_mm, surface.triangles, false),
      rms_mm(samples_of(surface.vertices_mm, surface.triangles, any), mesh.nodes_mm, boundary, true));
}

/// S* of an ellipsoid of 60 mm with waves, as the camera gives it with 0.4 mm of noise.
Surface organ_surface() {
  test::View view;
  view.noise_mm = 0.4;
  return cocone(clean_points(test::look_at(test::bumpy_organ(), view), 1.5, {}).position_mm, {});
}

std::string volume_table() {
  std::string table =
      "| body | asked for | elements | smallest dihedral angle deg | camera side to S* / back, RMS mm | ms |\n"
      "|---|---|---|---|---|---|\n"
      "| goal | | within 10 % | >= 10 | <= 0.3 from 1344 up | <= 300 at 1344, <= 1500 at 10 000 |\n";
  const Surface seen = organ_surface();
  const Surface closed = close_body(seen, 25);
  for (int elements : {500, 1344, 10000, 50000}) {
    MeshReport report;
    Stopwatch watch;
    const TetMesh mesh = tetrahedralize(closed, elements, {}, &report);
    const double time_ms = watch.lap_ms();
    table += fmt::format("| bumpy organ behind S* | {} | {} ({:+.1f} %) | {:.1f} | {} | {:.0f} |\n", elements,
                         report.elements, 100.0 * (report.elements - elements) / elements, report.smallest_dihedral_deg,
                         fit_to_surface(mesh, seen), time_ms);
  }
  return table;
}

std::string phi_row(const std::string& name, const std::filesystem::path& scene_file) {
  const Scene scene = read_scene(scene_file);
  Recording recording(scene.recording);
  const Rectification rectification =
      make_rectification(read_rig(scene.recording.calibration, scene.recording.translation_unit), recording.size());
  std::optional<StereoFrame> frame = recording.next();
  while (frame && frame->index < scene.map.frame) frame = recording.next();
  if (!frame) return fmt::format("| {} | no frame {} |\n", name, scene.map.frame);
  std::vector<std::pair<double, TissueMap>> builds;
  for (int i = 0; i < 3; ++i) {
    Stopwatch watch;
    TissueMap map = build_tissue_map(*frame, rectification, scene.map, scene.tissue, scene.attachments);
    builds.emplace_back(watch.lap_ms(), std::move(map));
  }
  std::sort(builds.begin(), builds.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto& [time_ms, map] = builds[1];
  const MapReport& r = map.report;
  return fmt::format(
      "| {} | {}x{} | {} | {:.1f} | {} | {:.0f} | {:.0f} + {:.0f} + {:.0f} + {:.0f} + {:.0f} + {:.0f} + {:.0f} |\n",
      name, recording.size().width, recording.size().height, map.mesh.tetrahedra.size(), r.mesh.smallest_dihedral_deg,
      fit_to_surface(map.mesh, map.surface), time_ms, r.rectify_ms, r.match_ms, r.triangulate_ms, r.edges_ms,
      r.surface_ms, r.volume_ms, r.attachments_ms);
}

std::string phi_table() {
  std::string table =
      "| sequence | image | elements | smallest dihedral angle deg | camera side to S* / back, RMS mm | Phi ms | "
      "rectify + "
      "match + triangulate + edges + surface + volume + attachments ms |\n|---|---|---|---|---|---|---|\n"
      "| goal | 960x540 | 1344 | >= 10 | <= 0.3 | <= 1000 | |\n";
  const std::filesystem::path data = test::reference_data();
  setenv("PALPATE_REFERENCE_DATA", std::filesystem::absolute(data).c_str(), 0);
  for (const char* name : {"rendered_uterus", "rendered_liver"})
    if (std::filesystem::exists(data / name)) table += phi_row(name, data / name / "scene.yaml");
  for (const char* name : {"surgt_tissue", "hamlyn_heart", "scared_keyframe"})
    if (std::filesystem::exists(data / name))
      table += phi_row(name, std::filesystem::path(PALPATE_SOURCE_DIR) / "studies" / (std::string(name) + ".yaml"));
  return table;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string only = argc > 2 && std::string(argv[1]) == "--only" ? argv[2] : "";
  std::string tables;
  const auto add = [&](const std::string& name, const std::string& title, const std::function<std::string()>& make) {
    if (!only.empty() && only != name) return;
    const std::string text = fmt::format("**{}**\n\n{}\n", title, make());
    fmt::print("{}", text);
    std::fflush(stdout);
    tables += text;
  };
  add("surface",
      "Surface: distance to known shapes, mm / angle of the normals, degrees (root mean squares); 1.5 mm between "
      "points",
      surface_accuracy_table);
  add("times", "Surface: times", surface_time_table);
  add("volume", "Volume", volume_table);
  add("phi", "Whole Phi", phi_table);
  add("edges", "Edges", [&] {
    const std::filesystem::path page = argc == 2 ? argv[1] : "";
    return edge_table(page.empty() ? page : page.parent_path() / "images/edges");
  });
  if (argc == 2) bench::write_between(argv[1], kBegin, kEnd, tables);
  return EXIT_SUCCESS;
}
