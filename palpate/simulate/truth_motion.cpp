#include "palpate/simulate/truth_motion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include "palpate/contact/equilibrium.h"
#include "palpate/core/errors.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/pushed_tissue.h"
#include "palpate/simulate/ray_scene.h"

namespace palpate {
namespace {

const double kTruthResidual = 1e-8;

bool inside(const SimulatedCamera& camera, cv::Point2d px) {
  return px.x >= 0 && px.y >= 0 && px.x <= camera.width - 1 && px.y <= camera.height - 1;
}

InstrumentPlace place_instrument(const SimulatedInstrument& instrument, const TouchPoint& touch,
                                 const GesturePose& pose, const Vec3& tissue_moved_mm, const Vec3& breath_mm) {
  const Vec3 at_tissue = touch.point_mm + tissue_moved_mm + touch.axes * pose.move_mm;
  InstrumentPlace place;
  place.axis = (at_tissue - instrument.enters_from).normalized();
  place.tip_mm = at_tissue - pose.away * instrument.free_distance_mm * place.axis;
  place.opening = pose.opening;
  if (breath_mm != Vec3::Zero()) {
    place.tip_mm += breath_mm;
    place.axis = (place.tip_mm - instrument.enters_from).normalized();
  }
  return place;
}

// Tissue that one or two tips hold whatever they do.
class HeldTissue {
 public:
  HeldTissue(const TetModel& model, const TruthBody& body, const EquilibriumOptions& precision)
      : body_(body), solver_(model, precision), displacements_mm_(body.patches.size()) {}

  /// The tip is at this displacement from where it took hold.
  void move(size_t tip, const Vec3& displacement_mm) {
    if (!holds(tip)) {
      solver_.hold_also(body_.patches[tip].footprint);
      held_.push_back(tip);
    }
    displacements_mm_[tip] = displacement_mm;
  }

  void leave(size_t tip) {
    if (!holds(tip)) return;
    const auto place = std::find(held_.begin(), held_.end(), tip);
    solver_.let_go(static_cast<size_t>(place - held_.begin()));
    held_.erase(place);
  }

  bool holds(size_t tip) const { return std::find(held_.begin(), held_.end(), tip) != held_.end(); }

  /// `contacts` are by tip.
  Equilibrium solve() {
    std::vector<Vec3> displacements_mm;
    for (size_t tip : held_) displacements_mm.push_back(displacements_mm_[tip]);
    Equilibrium equilibrium = solver_.solve_all(displacements_mm);
    std::vector<ContactForce> by_tip(body_.patches.size());
    for (size_t i = 0; i < held_.size(); ++i) by_tip[held_[i]] = equilibrium.contacts[i];
    equilibrium.contacts = std::move(by_tip);
    return equilibrium;
  }

  /// By how much a patch is moved in a state.
  Vec3 moved_mm(size_t tip, const Eigen::VectorXd& u) const {
    Vec3 mean = Vec3::Zero();
    const auto& samples = body_.patches[tip].footprint.samples;
    for (const Footprint::Sample& sample : samples)
      mean += u.segment<3>(3 * sample.nodes[0]) / static_cast<double>(samples.size());
    return mean;
  }

 private:
  const TruthBody& body_;
  EquilibriumSolver solver_;
  std::vector<size_t> held_;  // in the order of the solver
  std::vector<Vec3> displacements_mm_;
};

/// The second instrument goes where the first has moved the tissue, until it takes hold itself.
struct SecondTip {
  Vec3 tissue_moved_mm = Vec3::Zero();
  bool took_hold = false;
};

void fill_row(TruthRow& row, int field, int fields, double fps, const SimulatedCamera& camera, const Vec3& tip_mm) {
  row.frame = field / fields;
  row.time_s = field / (fields * fps);
  row.tip_mm = tip_mm;
  row.visible = tip_mm.z() > 0 && inside(camera, project(camera, tip_mm, 0)) &&
                inside(camera, project(camera, tip_mm, camera.baseline_mm));
}

// The touch point on the boundary of the true body: the drawn organ is finer, and may lie above it or below.
TouchPoint on_body(const TruthBody& body, TouchPoint touch) {
  touch.point_mm = closest_point(touch.point_mm, body.mesh.nodes_mm, body.boundary).point;
  return touch;
}

void check_equilibrium(const Equilibrium& equilibrium, double time_s, const Vec3& move_mm, MotionQuality& quality) {
  if (!equilibrium.converged)
    throw BadInput(
        fmt::format("simulate.gesture: at {:.2f} s, moved by [{:.2f}, {:.2f}, {:.2f}] mm, the tissue has no "
                    "equilibrium; move it less or choose another law",
                    time_s, move_mm.x(), move_mm.y(), move_mm.z()));
  quality.largest_residual = std::max(quality.largest_residual, equilibrium.residual);
  quality.smallest_volume_ratio = std::min(quality.smallest_volume_ratio, equilibrium.smallest_volume_ratio);
}

}  // namespace

cv::Point2d project(const SimulatedCamera& camera, const Vec3& point, double eye_x_mm) {
  return {camera.focal_px * (point.x() - eye_x_mm) / point.z() + 0.5 * (camera.width - 1),
          camera.focal_px * point.y() / point.z() + 0.5 * (camera.height - 1)};
}

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

double motion_duration_s(const SimulateOptions& options) {
  const double first_s = gesture_duration_s(options.gesture);
  return options.second.present ? std::max(first_s, gesture_duration_s(options.second.gesture)) : first_s;
}

std::vector<Moment> solve_motion(const SimulateOptions& options, const TissueOptions& tissue, const TruthBody& truth,
                                 const std::vector<TouchPoint>& touches, double friction, int frames,
                                 MotionQuality& quality, const std::function<void()>& step) {
  const TetModel model(truth.mesh, tissue, truth.fixed_nodes, Element::averaged);
  EquilibriumOptions precise;
  precise.relative_residual = kTruthResidual;
  const TouchPoint& touch = touches.at(0);
  HeldTissue grasped(model, truth, precise);
  PushedTissue pushed(model, truth, on_body(truth, touch), friction, precise);
  const bool push = is_push(options.gesture);
  const int fields = options.look.interlace ? 2 : 1;
  SecondTip second;
  std::vector<Moment> moments;
  for (int field = 0; field < fields * frames; ++field) {
    const double time_s = field / (fields * options.camera.fps);
    Moment moment;
    moment.breath_mm = breath_mm(options.breathing, time_s);
    const GesturePose pose = gesture_at(options.gesture, time_s);
    moment.place = place_instrument(options.instrument, touch, pose, Vec3::Zero(), moment.breath_mm);
    fill_row(moment.truth, field, fields, options.camera.fps, options.camera, moment.place.tip_mm);
    const Vec3 move_mm = touch.axes * pose.move_mm;
    const auto hold = [&grasped](size_t tip, bool holds, const Vec3& displacement_mm) {
      if (holds)
        grasped.move(tip, displacement_mm);
      else
        grasped.leave(tip);
    };
    std::optional<Equilibrium> equilibrium;
    if (push && pose.in_contact) {
      if (PushedTissue::Answer answer = pushed.move(move_mm); answer.touching)
        equilibrium = std::move(answer.equilibrium);
      moment.truth.in_contact = equilibrium.has_value();
      if (equilibrium) moment.truth.force_N = equilibrium->force_N;
    } else {
      pushed.leave();
      hold(0, !push && pose.in_contact, move_mm);
      moment.truth.in_contact = grasped.holds(0);
    }
    if (options.second.present) {
      const GesturePose other = gesture_at(options.second.gesture, time_s);
      if (!other.in_contact && !second.took_hold && grasped.holds(0))
        second.tissue_moved_mm = grasped.moved_mm(1, grasped.solve().u);
      second.took_hold |= other.in_contact;
      hold(1, other.in_contact, touches.at(1).axes * other.move_mm);
      moment.second_place =
          place_instrument(options.second.instrument, touches.at(1), other, second.tissue_moved_mm, moment.breath_mm);
      fill_row(moment.second_truth, field, fields, options.camera.fps, options.camera, moment.second_place.tip_mm);
      moment.second_truth.in_contact = grasped.holds(1);
    }
    if (!push && (moment.truth.in_contact || moment.second_truth.in_contact)) {
      equilibrium = grasped.solve();
      moment.truth.force_N = equilibrium->contacts[0].force_N;
      if (options.second.present) moment.second_truth.force_N = equilibrium->contacts[1].force_N;
    }
    if (equilibrium) {
      check_equilibrium(*equilibrium, time_s, pose.move_mm, quality);
      moment.u = std::move(equilibrium->u);
    }
    moments.push_back(std::move(moment));
    step();
  }
  return moments;
}

}  // namespace palpate
