#include "palpate/simulate/dejavu.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/simulate/dejavu_files.h"
#include "palpate/simulate/force_sensor.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/stage.h"
#include "palpate/volume/inside.h"

namespace palpate {
namespace {

const int kDrawnTriangles = 20000;  // of the organ, at least
const int kFilledTriangles = 5000;  // of the surface that the true body is cut from, at least

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Volume over the area of the shadow along the optical axis: pushed back by this much, the visible surface encloses as
/// much as the organ does.
double mean_thickness_mm(const Surface& organ) {
  double twice_shadow_mm2 = 0;
  for (const Triangle& t : organ.triangles) {
    const auto corner = [&](size_t k) { return organ.vertices_mm[static_cast<size_t>(t[k])]; };
    twice_shadow_mm2 += 0.5 * std::abs((corner(1) - corner(0)).cross(corner(2) - corner(0)).z());
  }
  return enclosed_volume_mm3(organ) / (0.5 * twice_shadow_mm2);
}

std::vector<cv::Point2d> outline(const cv::Mat& mask) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) throw BadInput("simulate.body: the organ is not in view of the left camera");
  const auto largest = std::max_element(contours.begin(), contours.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  std::vector<cv::Point> corners;
  cv::approxPolyDP(*largest, corners, 1.0, true);
  if (corners.size() < 3) throw BadInput("simulate.body: the organ is too small in the left image");
  return {corners.begin(), corners.end()};
}

// Direction of the shaft when it first touches.
Vec3 touching_axis(const std::vector<Moment>& moments) {
  const auto touch = std::find_if(moments.begin(), moments.end(), [](const Moment& m) { return m.truth.in_contact; });
  return (touch == moments.end() ? moments.front() : *touch).place.axis;
}

// Facts about the moments that the summary tells.
void summarise(const std::vector<Moment>& moments, DejaVuSummary& summary) {
  for (const Moment& moment : moments) {
    const TruthRow& row = moment.truth;
    if (!row.in_contact) continue;
    if (summary.first_contact_frame < 0) summary.first_contact_frame = row.frame;
    summary.last_contact_frame = row.frame;
    if (row.force_N.norm() > summary.peak_force_N) {
      summary.peak_force_N = row.force_N.norm();
      summary.peak_frame = row.frame;
    }
  }
}

}  // namespace

DejaVuSummary simulate_dejavu(const SimulateOptions& options, const TissueOptions& tissue,
                              const AttachmentOptions& attachments, const ContactOptions& contact,
                              const std::filesystem::path& folder,
                              const std::function<void(int done, int total)>& progress) {
  check_gesture(options.gesture);
  const Surface organ = make_organ(options.body, kDrawnTriangles);
  std::vector<TouchPoint> touches;
  std::vector<TruthContact> contacts;
  const auto touch = [&](const std::vector<GestureRow>& gesture) {
    const GestureRow& approach = approach_row(gesture);
    touches.push_back(find_touch_point(organ, options.camera, approach.at_px));
    contacts.push_back({touches.back().point_mm, touches.back().axes.col(0),
                        approach.footprint_radius_mm > 0 ? approach.footprint_radius_mm : contact.footprint_radius_mm,
                        is_push(gesture) ? longest_drag_mm(gesture) : 0, options.truth.patch,
                        touches.back().axes.col(1)});
  };
  touch(options.gesture);
  if (options.second.present) touch(options.second.gesture);
  const bool push = is_push(options.gesture);
  const TruthBody truth = make_truth_body(
      make_organ(options.body, kFilledTriangles), options.body.elements, attachments,
      [&](const Vec3& point) { return project(options.camera, point, 0); }, contacts);

  DejaVuSummary summary;
  summary.frames = static_cast<int>(std::lround(motion_duration_s(options) * options.camera.fps)) + 1;
  summary.truth_elements = static_cast<int>(truth.mesh.tetrahedra.size());
  summary.truth_nodes = static_cast<int>(truth.mesh.nodes_mm.size());
  summary.tied_nodes = static_cast<int>(truth.patches[0].footprint.samples.size());
  summary.thickness_mm = mean_thickness_mm(organ);
  summary.contact_mm = touches[0].point_mm;
  summary.contact_normal = touches[0].axes.col(0);
  summary.contact_radius_mm = truth.patches[0].radius_mm;
  if (options.write.grip == SimulatedFiles::Grip::known) summary.grip = push ? Grip::push : Grip::grasp;

  const int fields = options.look.interlace ? 2 : 1;
  int done = 0;
  const auto step = [&] {
    ++done;
    if (progress) progress(done, 2 * fields * summary.frames);
  };
  const auto solve_start = Clock::now();
  MotionQuality quality;
  const std::vector<Moment> moments =
      solve_motion(options, tissue, truth, touches, contact.friction, summary.frames, quality, step);
  summarise(moments, summary);
  summary.largest_residual = quality.largest_residual;
  summary.smallest_volume_ratio = quality.smallest_volume_ratio;
  summary.solve_s = seconds_since(solve_start);

  const auto draw_start = Clock::now();
  Stage stage(options, organ, truth, moments.front());
  summary.organ_region_px = outline(stage.organ_mask());
  std::filesystem::create_directories(folder);
  write_calibration(folder / "calibration.yaml", options.camera);
  std::vector<TruthRow> rows;
  for (size_t i = 0; i < moments.size(); i += static_cast<size_t>(fields)) rows.push_back(moments[i].truth);
  write_truth(folder / "truth.csv", rows);
  if (options.second.present) {
    std::vector<TruthRow> second_rows;
    for (size_t i = 0; i < moments.size(); i += static_cast<size_t>(fields))
      second_rows.push_back(moments[i].second_truth);
    write_truth(folder / "truth_2.csv", second_rows);
  }
  if (options.write.sensor) {
    const ForceSensor sensor = make_force_sensor(touching_axis(moments), options.look.seed);
    write_force_sensor(folder, sensor, log_of(sensor, rows, options.look.seed));
  }
  StereoVideoWriter video(folder, options.camera);
  const FrameFiles frame_files(folder, options.write);
  for (size_t i = 0; i < moments.size(); i += static_cast<size_t>(fields)) {
    const int frame = moments[i].truth.frame;
    stage.show(moments[i]);
    StereoLight light = stage.light(frame, moments[i].truth.time_s);
    frame_files.write_surface(frame, stage.shown_organ());
    step();
    if (options.look.interlace) {
      stage.show(moments[i + 1]);
      light = woven(light, stage.light(frame, moments[i + 1].truth.time_s));
      step();
    }
    frame_files.write_depth(frame, light.left_depth_mm);
    video.write(recorded(light, options.camera, options.look, frame));
  }
  summary.draw_s = seconds_since(draw_start);
  return summary;
}

}  // namespace palpate
