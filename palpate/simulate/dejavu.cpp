#include "palpate/simulate/dejavu.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "palpate/contact/equilibrium.h"
#include "palpate/core/errors.h"
#include "palpate/simulate/dejavu_files.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/instrument_shape.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/ray_scene.h"
#include "palpate/simulate/render.h"
#include "palpate/simulate/truth_body.h"

namespace palpate {
namespace {

const int kDrawnTriangles = 20000;  // of the organ, at least
const int kFilledTriangles = 5000;  // of the surface that the true body is cut from, at least
const double kTruthResidual = 1e-8;
const double kWallBehind_mm = 14;

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

cv::Point2d project(const SimulatedCamera& camera, const Vec3& point, double eye_x_mm) {
  return {camera.focal_px * (point.x() - eye_x_mm) / point.z() + 0.5 * (camera.width - 1),
          camera.focal_px * point.y() / point.z() + 0.5 * (camera.height - 1)};
}

bool inside(const SimulatedCamera& camera, cv::Point2d px) {
  return px.x >= 0 && px.y >= 0 && px.x <= camera.width - 1 && px.y <= camera.height - 1;
}

// Where and how the tissue is touched, at rest. Columns of `axes`: outward normal, tangents to the right and down.
struct TouchPoint {
  Vec3 point_mm;
  Mat3 axes;
};

TouchPoint find_touch_point(const Surface& organ, const SimulatedCamera& camera, cv::Point2d at_px) {
  RayScene rays;
  rays.add(organ.triangles, organ.vertices_mm.size());
  rays.place(0, organ.vertices_mm);
  rays.commit();
  const Vec3 direction((at_px.x - 0.5 * (camera.width - 1)) / camera.focal_px,
                       (at_px.y - 0.5 * (camera.height - 1)) / camera.focal_px, 1);
  const RayHit hit = rays.first_hit(Eigen::Vector3f::Zero(), direction.cast<float>());
  if (hit.surface < 0)
    throw BadInput(fmt::format("simulate.gesture: at_px [{}, {}] does not show the organ", at_px.x, at_px.y));
  const Triangle& triangle = organ.triangles[static_cast<size_t>(hit.triangle)];
  const std::vector<Vec3> normals = vertex_normals(organ.vertices_mm, organ.triangles);
  const double weight[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
  Vec3 normal = Vec3::Zero();
  for (size_t k = 0; k < 3; ++k) normal += weight[k] * normals[static_cast<size_t>(triangle[k])];
  TouchPoint touch;
  touch.point_mm = hit.length * direction;
  touch.axes.col(0) = normal.normalized();
  touch.axes.col(1) = (Vec3::UnitX() - touch.axes.col(0) * touch.axes(0, 0)).normalized();
  touch.axes.col(2) = touch.axes.col(1).cross(touch.axes.col(0));
  return touch;
}

InstrumentPlace place_instrument(const SimulatedInstrument& instrument, const TouchPoint& touch,
                                 const GesturePose& pose) {
  const Vec3 at_tissue = touch.point_mm + touch.axes * pose.move_mm;
  InstrumentPlace place;
  place.axis = (at_tissue - instrument.enters_from).normalized();
  place.tip_mm = at_tissue - pose.away * instrument.free_distance_mm * place.axis;
  place.opening = pose.opening;
  return place;
}

// The back of the cavity: a shallow bowl behind the organ that fills both images.
Surface make_wall(const SimulatedCamera& camera, const Surface& organ) {
  double deepest = 0;
  for (const Vec3& vertex : organ.vertices_mm) deepest = std::max(deepest, vertex.z());
  const double depth = deepest + kWallBehind_mm;
  const double half_x = 0.6 * depth * camera.width / camera.focal_px + camera.baseline_mm;
  const double half_y = 0.6 * depth * camera.height / camera.focal_px;
  const int columns = 100, rows = 60;
  Surface wall;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) {
      const double a = 2.0 * i / columns - 1, b = 2.0 * j / rows - 1;
      wall.vertices_mm.emplace_back(half_x * a, half_y * b, depth * (1 - 0.10 * (a * a + b * b)));
    }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int corner = j * (columns + 1) + i, below = corner + columns + 1;
      wall.triangles.push_back({corner, below, corner + 1});
      wall.triangles.push_back({corner + 1, below, below + 1});
    }
  return wall;
}

double extent_along_view_mm(const Surface& organ) {
  const auto [nearest, farthest] = std::minmax_element(organ.vertices_mm.begin(), organ.vertices_mm.end(),
                                                       [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  return farthest->z() - nearest->z();
}

std::vector<cv::Point2d> outline(const cv::Mat& mask) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) throw BadInput("simulate.body: the organ is not in view of the left eye");
  const auto largest = std::max_element(contours.begin(), contours.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  std::vector<cv::Point> corners;
  cv::approxPolyDP(*largest, corners, 1.0, true);
  if (corners.size() < 3) throw BadInput("simulate.body: the organ is too small in the left image");
  return {corners.begin(), corners.end()};
}

// Everything that is known before a picture is drawn.
struct Motion {
  std::vector<TruthRow> rows;
  std::vector<InstrumentPlace> places;
  std::vector<Eigen::VectorXd> displacements;  // of the true nodes; empty = at rest
};

Motion solve_motion(const SimulateOptions& options, const TissueOptions& tissue, const TruthBody& truth,
                    const TouchPoint& touch, DejaVuSummary& summary, const std::function<void()>& step) {
  const TetModel model(truth.mesh, tissue, truth.fixed_nodes, Element::averaged);
  EquilibriumOptions precise;
  precise.relative_residual = kTruthResidual;
  EquilibriumSolver solver(model, precise);
  Motion motion;
  bool holding = false;
  for (int frame = 0; frame < summary.frames; ++frame) {
    const double time_s = frame / options.camera.fps;
    const GesturePose pose = gesture_at(options.gesture, time_s);
    const InstrumentPlace place = place_instrument(options.instrument, touch, pose);
    TruthRow row{frame, time_s, pose.in_contact, Vec3::Zero(), place.tip_mm, false};
    row.visible = place.tip_mm.z() > 0 && inside(options.camera, project(options.camera, place.tip_mm, 0)) &&
                  inside(options.camera, project(options.camera, place.tip_mm, options.camera.baseline_mm));
    Eigen::VectorXd u;
    if (pose.in_contact) {
      if (!holding) solver.hold(truth.footprint);
      Equilibrium equilibrium = solver.solve(touch.axes * pose.move_mm);
      if (!equilibrium.converged)
        throw BadInput(
            fmt::format("simulate.gesture: at {:.2f} s, moved by [{:.2f}, {:.2f}, {:.2f}] mm, the tissue has no "
                        "equilibrium; move it less or choose another law",
                        time_s, pose.move_mm.x(), pose.move_mm.y(), pose.move_mm.z()));
      row.force_N = equilibrium.force_N;
      summary.largest_residual = std::max(summary.largest_residual, equilibrium.residual);
      summary.smallest_volume_ratio = std::min(summary.smallest_volume_ratio, equilibrium.smallest_volume_ratio);
      if (summary.first_contact_frame < 0) summary.first_contact_frame = frame;
      summary.last_contact_frame = frame;
      if (row.force_N.norm() > summary.peak_force_N) {
        summary.peak_force_N = row.force_N.norm();
        summary.peak_frame = frame;
      }
      u = std::move(equilibrium.u);
    } else if (holding) {
      solver.release();
    }
    holding = pose.in_contact;
    motion.rows.push_back(row);
    motion.places.push_back(place);
    motion.displacements.push_back(std::move(u));
    step();
  }
  return motion;
}

// The three surfaces that are drawn.
struct Stage {
  Renderer renderer;
  int organ, wall, instrument;
};

Stage set_stage(const SimulateOptions& options, const Surface& organ, const InstrumentPlace& first_place) {
  const auto texels_per_mm = [&](double depth) { return std::min(8.0, options.camera.focal_px / depth); };
  const Surface wall = make_wall(options.camera, organ);
  Stage stage{Renderer(options.camera, options.look), 0, 0, 0};
  stage.organ = stage.renderer.add(
      organ, {tissue_texture(options.look), texels_per_mm(organ.vertices_mm[0].z()), options.look.roughness, 0.04});
  stage.wall =
      stage.renderer.add(wall, {wall_texture(options.look.seed), texels_per_mm(wall.vertices_mm[0].z()), 0.6, 0.03});
  stage.instrument =
      stage.renderer.add(make_instrument(options.instrument, first_place), {steel_texture(), 1, 0.55, 0.35});
  return stage;
}

void draw_motion(const SimulateOptions& options, const Motion& motion, const Surface& organ, const Skin& skin,
                 Stage& stage, const std::filesystem::path& folder, const std::function<void()>& step) {
  StereoVideoWriter video(folder, options.camera);
  for (size_t i = 0; i < motion.rows.size(); ++i) {
    const bool at_rest = motion.displacements[i].size() == 0;
    stage.renderer.move(stage.organ,
                        at_rest ? organ.vertices_mm : moved_skin(skin, organ.vertices_mm, motion.displacements[i]));
    stage.renderer.move(stage.instrument, make_instrument(options.instrument, motion.places[i]).vertices_mm);
    video.write(stage.renderer.render(motion.rows[i].frame));
    step();
  }
}

}  // namespace

DejaVuSummary simulate_dejavu(const SimulateOptions& options, const TissueOptions& tissue,
                              const AttachmentOptions& attachments, const ContactOptions& contact,
                              const std::filesystem::path& folder,
                              const std::function<void(int done, int total)>& progress) {
  check_gesture(options.gesture);
  const GestureRow& approach = approach_row(options.gesture);
  const Surface organ = make_organ(options.body, kDrawnTriangles);
  const TouchPoint touch = find_touch_point(organ, options.camera, approach.at_px);
  const double radius_mm =
      approach.footprint_radius_mm > 0 ? approach.footprint_radius_mm : contact.footprint_radius_mm;
  const TruthBody truth = make_truth_body(
      make_organ(options.body, kFilledTriangles), options.body.elements, attachments,
      [&](const Vec3& point) { return project(options.camera, point, 0); }, touch.point_mm, touch.axes.col(0),
      radius_mm);

  DejaVuSummary summary;
  summary.frames = static_cast<int>(std::lround(gesture_duration_s(options.gesture) * options.camera.fps)) + 1;
  summary.truth_elements = static_cast<int>(truth.mesh.tetrahedra.size());
  summary.truth_nodes = static_cast<int>(truth.mesh.nodes_mm.size());
  summary.tied_nodes = static_cast<int>(truth.footprint.samples.size());
  summary.thickness_mm = extent_along_view_mm(organ);
  summary.contact_mm = touch.point_mm;
  summary.contact_normal = touch.axes.col(0);
  summary.contact_radius_mm = truth.patch_radius_mm;

  int done = 0;
  const auto step = [&] {
    ++done;
    if (progress) progress(done, 2 * summary.frames);
  };
  const auto solve_start = Clock::now();
  const Motion motion = solve_motion(options, tissue, truth, touch, summary, step);
  summary.solve_s = seconds_since(solve_start);

  const auto draw_start = Clock::now();
  const Skin skin = attach_skin(organ.vertices_mm, truth.mesh.nodes_mm, truth.boundary);
  Stage stage = set_stage(options, organ, motion.places.front());
  summary.organ_region_px = outline(stage.renderer.visible_mask(stage.organ));
  std::filesystem::create_directories(folder);
  write_calibration(folder / "calibration.yaml", options.camera);
  write_truth(folder / "truth.csv", motion.rows);
  draw_motion(options, motion, organ, skin, stage, folder, step);
  summary.draw_s = seconds_since(draw_start);
  return summary;
}

}  // namespace palpate
