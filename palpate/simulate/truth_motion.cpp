#include "palpate/simulate/truth_motion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include "palpate/contact/equilibrium.h"
#include "palpate/core/errors.h"
#include "palpate/simulate/free_tissue.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/pushed_tissue.h"
#include "palpate/simulate/ray_scene.h"
#include "palpate/simulate/scene_motion.h"

namespace palpate {
namespace {

const double kTruthResidual = 1e-8;

bool inside(const SimulatedCamera& camera, cv::Point2d px) {
  return px.x >= 0 && px.y >= 0 && px.x <= camera.width - 1 && px.y <= camera.height - 1;
}

// `met_mm`: by how much the tissue had moved where it is touched; `carried_mm`: by how much the hand goes with it.
InstrumentPlace place_instrument(const SimulatedInstrument& instrument, const TouchPoint& touch,
                                 const GesturePose& pose, const Vec3& met_mm, const Vec3& carried_mm) {
  const Vec3 at_tissue = touch.point_mm + met_mm + touch.axes * pose.move_mm;
  InstrumentPlace place;
  place.axis = (at_tissue - instrument.enters_from).normalized();
  place.tip_mm = at_tissue - pose.away * instrument.free_distance_mm * place.axis;
  place.opening = pose.opening;
  if (carried_mm != Vec3::Zero()) {
    place.tip_mm += carried_mm;
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
    solver_.release(static_cast<size_t>(place - held_.begin()));
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

 private:
  const TruthBody& body_;
  EquilibriumSolver solver_;
  std::vector<size_t> held_;  // in the order of the solver
  std::vector<Vec3> displacements_mm_;
};

/// The tissue as it moves by itself, without instruments. Sets the base of the model that the equilibria are of.
class FreeTissue {
 public:
  FreeTissue(TetModel& model, const SimulateOptions& options, const TruthBody& body)
      : model_(model), options_(options), body_(body) {}

  void at(double time_s) {
    organ_mm_ = organ_motion_mm(options_, time_s);
    if (options_.stretch.strain == Vec3::Zero()) return;
    u_ = stretch_free_tissue(model_, attachment_strain(options_.stretch, time_s), options_.body.center_mm);
  }
  const Vec3& organ_mm() const { return organ_mm_; }
  /// Empty = at rest.
  const Eigen::VectorXd& u() const { return u_; }
  /// By how much the tissue beneath a tip has moved.
  Vec3 moved_mm(size_t tip) const {
    return u_.size() == 0 ? organ_mm_ : organ_mm_ + patch_moved_mm(body_.patches[tip], u_);
  }

 private:
  TetModel& model_;
  const SimulateOptions& options_;
  const TruthBody& body_;
  Vec3 organ_mm_ = Vec3::Zero();
  Eigen::VectorXd u_;
};

/// One instrument at work.
struct Hand {
  const SimulatedInstrument& instrument;
  const std::vector<GestureRow>& gesture;
  TouchPoint touch;
  bool stands = false;            // while the tissue moves by itself
  Vec3 met_mm = Vec3::Zero();     // by how much the tissue has moved by itself when it is touched
  Vec3 pulled_mm = Vec3::Zero();  // by how much another instrument has moved the tissue when it is touched
  bool took_hold = false;

  /// `tissue_moved_mm`: by itself, as all that follows.
  InstrumentPlace place(const GesturePose& pose, const Vec3& tissue_moved_mm) const {
    return stands ? place_instrument(instrument, touch, pose, pulled_mm + met_mm, Vec3::Zero())
                  : place_instrument(instrument, touch, pose, pulled_mm, tissue_moved_mm);
  }
  /// Of the tip from where the tissue that it touched would be by itself.
  Vec3 displacement_mm(const GesturePose& pose, const Vec3& tissue_moved_mm) const {
    Vec3 displacement_mm = touch.axes * pose.move_mm;
    if (stands) displacement_mm += met_mm - tissue_moved_mm;
    if (pose.in_contact) return displacement_mm;
    return displacement_mm - pose.away * instrument.free_distance_mm * place(pose, tissue_moved_mm).axis;
  }
};

void fill_row(TruthRow& row, const SimulateOptions& options, int field, int fields, InstrumentPlace& place) {
  const SimulatedCamera& camera = options.camera;
  row.frame = field / fields;
  row.time_s = field / (fields * camera.fps);
  place.tip_mm -= camera_motion_mm(camera.pan, row.time_s);
  row.tip_mm = place.tip_mm;
  row.visible = row.tip_mm.z() > 0 && inside(camera, project(camera, row.tip_mm, 0)) &&
                inside(camera, project(camera, row.tip_mm, camera.baseline_mm)) &&
                !is_obscured(options.obscured, row.time_s);
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

cv::Point2d project(const SimulatedCamera& camera, const Vec3& point, double camera_x_mm) {
  return {camera.focal_px * (point.x() - camera_x_mm) / point.z() + 0.5 * (camera.width - 1),
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
  TetModel model(truth.mesh, tissue, truth.fixed_nodes, Element::averaged);
  EquilibriumOptions precise;
  precise.relative_residual = kTruthResidual;
  FreeTissue free(model, options, truth);
  const bool drifts = moves_beneath_hand(options);
  std::vector<Hand> hands{{options.instrument, options.gesture, touches.at(0)}};
  if (options.second.present) hands.push_back({options.second.instrument, options.second.gesture, touches.at(1)});
  for (size_t tip = 0; tip < hands.size() && drifts; ++tip) {
    free.at(touch_time_s(hands[tip].gesture));
    hands[tip].stands = true;
    hands[tip].met_mm = free.moved_mm(tip);
  }
  const double touch_s = touch_time_s(options.gesture);
  const bool push = is_push(options.gesture), alone = !options.second.present;
  HeldTissue grasped(model, truth, precise);
  PushedTissue pushed(model, truth, on_body(truth, touches[0]), friction, precise);
  const int fields = options.look.interlace ? 2 : 1;
  std::vector<Moment> moments;
  for (int field = 0; field < fields * frames; ++field) {
    const double time_s = field / (fields * options.camera.fps);
    free.at(time_s);
    Moment moment;
    moment.scene_mm = free.organ_mm() - camera_motion_mm(options.camera.pan, time_s);
    moment.u = free.u();
    const GesturePose pose = gesture_at(options.gesture, time_s);
    const Vec3 displacement_mm = hands[0].displacement_mm(pose, free.moved_mm(0));
    moment.place = hands[0].place(pose, free.moved_mm(0));
    fill_row(moment.truth, options, field, fields, moment.place);
    const auto hold = [&grasped](size_t tip, bool holds, const Vec3& to_mm) {
      if (holds)
        grasped.move(tip, to_mm);
      else
        grasped.leave(tip);
    };
    const bool holds = !push && pose.in_contact;
    const bool presses = (push && pose.in_contact) || (drifts && alone && !holds && time_s > touch_s);
    hold(0, holds, displacement_mm);
    std::optional<Equilibrium> equilibrium;
    if (presses) {
      if (PushedTissue::Answer answer = pushed.move(displacement_mm); answer.touching)
        equilibrium = std::move(answer.equilibrium);
      if (equilibrium) moment.truth.force_N = equilibrium->force_N;
    } else {
      pushed.leave();
    }
    moment.truth.in_contact = equilibrium || grasped.holds(0);
    if (!alone) {
      Hand& second = hands[1];
      const GesturePose other = gesture_at(options.second.gesture, time_s);
      if (!other.in_contact && !second.took_hold && grasped.holds(0))
        second.pulled_mm = free.organ_mm() + patch_moved_mm(truth.patches[1], grasped.solve().u) - free.moved_mm(1);
      second.took_hold |= other.in_contact;
      hold(1, other.in_contact, second.displacement_mm(other, free.moved_mm(1)));
      moment.second_place = second.place(other, free.moved_mm(1));
      fill_row(moment.second_truth, options, field, fields, moment.second_place);
      moment.second_truth.in_contact = grasped.holds(1);
    }
    if (grasped.holds(0) || moment.second_truth.in_contact) {
      equilibrium = grasped.solve();
      moment.truth.force_N = equilibrium->contacts[0].force_N;
      if (!alone) moment.second_truth.force_N = equilibrium->contacts[1].force_N;
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
