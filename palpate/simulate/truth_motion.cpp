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
                                 const GesturePose& pose, const Vec3& breath_mm) {
  const Vec3 at_tissue = touch.point_mm + touch.axes * pose.move_mm;
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

// Tissue that the tip holds whatever it does.
class HeldTissue {
 public:
  HeldTissue(const TetModel& model, const TruthBody& body, const EquilibriumOptions& precision)
      : body_(body), solver_(model, precision) {}

  Equilibrium move(const Vec3& displacement_mm) {
    if (!holding_) solver_.hold(body_.footprint);
    holding_ = true;
    return solver_.solve(displacement_mm);
  }

  void leave() {
    if (holding_) solver_.release();
    holding_ = false;
  }

 private:
  const TruthBody& body_;
  EquilibriumSolver solver_;
  bool holding_ = false;
};

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

std::vector<Moment> solve_motion(const SimulateOptions& options, const TissueOptions& tissue, const TruthBody& truth,
                                 const TouchPoint& touch, double friction, int frames, MotionQuality& quality,
                                 const std::function<void()>& step) {
  const TetModel model(truth.mesh, tissue, truth.fixed_nodes, Element::averaged);
  EquilibriumOptions precise;
  precise.relative_residual = kTruthResidual;
  HeldTissue grasped(model, truth, precise);
  PushedTissue pushed(model, truth, touch, friction, precise);
  const bool push = is_push(options.gesture);
  const int fields = options.look.interlace ? 2 : 1;
  std::vector<Moment> moments;
  for (int field = 0; field < fields * frames; ++field) {
    Moment moment;
    TruthRow& row = moment.truth;
    row.frame = field / fields;
    row.time_s = field / (fields * options.camera.fps);
    const GesturePose pose = gesture_at(options.gesture, row.time_s);
    moment.breath_mm = breath_mm(options.breathing, row.time_s);
    moment.place = place_instrument(options.instrument, touch, pose, moment.breath_mm);
    row.tip_mm = moment.place.tip_mm;
    row.visible = row.tip_mm.z() > 0 && inside(options.camera, project(options.camera, row.tip_mm, 0)) &&
                  inside(options.camera, project(options.camera, row.tip_mm, options.camera.baseline_mm));
    const Vec3 move_mm = touch.axes * pose.move_mm;
    std::optional<Equilibrium> equilibrium;
    if (!pose.in_contact) {
      grasped.leave();
      pushed.leave();
    } else if (push) {
      if (PushedTissue::Answer answer = pushed.move(move_mm); answer.touching)
        equilibrium = std::move(answer.equilibrium);
    } else {
      equilibrium = grasped.move(move_mm);
    }
    row.in_contact = equilibrium.has_value();
    if (equilibrium) {
      if (!equilibrium->converged)
        throw BadInput(
            fmt::format("simulate.gesture: at {:.2f} s, moved by [{:.2f}, {:.2f}, {:.2f}] mm, the tissue has no "
                        "equilibrium; move it less or choose another law",
                        row.time_s, pose.move_mm.x(), pose.move_mm.y(), pose.move_mm.z()));
      row.force_N = equilibrium->force_N;
      quality.largest_residual = std::max(quality.largest_residual, equilibrium->residual);
      quality.smallest_volume_ratio = std::min(quality.smallest_volume_ratio, equilibrium->smallest_volume_ratio);
      moment.u = std::move(equilibrium->u);
    }
    moments.push_back(std::move(moment));
    step();
  }
  return moments;
}

}  // namespace palpate
