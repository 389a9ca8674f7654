#include "palpate/simulate/uterus_demo.h"

#include "palpate/simulate/organ_shape.h"

namespace palpate {
namespace {

GestureRow approach(double seconds, cv::Point2d at_px, double radius_mm) {
  GestureRow row;
  row.approach_s = seconds;
  row.at_px = at_px;
  row.footprint_radius_mm = radius_mm;
  return row;
}

GestureRow grasp() {
  GestureRow row;
  row.grasp = true;
  return row;
}

GestureRow move(const Vec3& normal_and_tangents_mm, double seconds) {
  GestureRow row;
  row.move_mm = normal_and_tangents_mm;
  row.during_s = seconds;
  return row;
}

GestureRow hold(double seconds) {
  GestureRow row;
  row.hold_s = seconds;
  return row;
}

GestureRow release(double leave_s) {
  GestureRow row;
  row.release = true;
  row.leave_s = leave_s;
  return row;
}

}  // namespace

SimulatedCase uterus_demo() {
  SimulatedCase demo;
  SimulatedBody& body = demo.simulate.body;
  body.shape = "pear";
  body.size_mm = {62, 48, 44};
  body.center_mm = {-6, 2, 112};
  body.rotation_deg = {-18, 12, 12};
  demo.simulate.gesture = {
      approach(0.6, {408, 196}, 3.5),
      grasp(),
      hold(0.12),
      move({2.4, 0.5, 0.3}, 0.72),
      hold(0.32),
      move({0, 0, 0}, 0.6),
      hold(0.08),
      move({-1.2, 0.3, 0.2}, 0.52),
      hold(0.32),
      move({0, 0, 0}, 0.4),
      hold(0.08),
      release(0.6),
  };

  demo.tissue.law = Law::saint_venant_kirchhoff;
  demo.tissue.young_modulus_kPa = 400;
  demo.tissue.poisson_ratio = 0.35;

  // Everything farther back than a plane 8 mm behind the middle of the organ.
  const Mat3 turn = left_from_body(body);
  AttachmentRegion back;
  back.kind = AttachmentRegion::Kind::oriented_box;
  back.half_size_mm = {60, 60, 26};
  back.center_mm = body.center_mm + turn * Vec3(0, 0, 8 + 26);
  back.axes = turn.transpose();
  demo.attachments.regions = {back};

  demo.contact.footprint_radius_mm = 3.5;
  demo.contact.grip = Grip::grasp;
  return demo;
}

}  // namespace palpate
