#include "palpate/contact/tip_contact.h"

#include <algorithm>
#include <utility>

namespace palpate {

namespace {

/// A tip has pressed when it was so deep in so many frames; before, it only touches, and retreats by its own noise.
constexpr double kPressed_mm = 0.3;
constexpr int kPressedFrames = 2;
/// A lifted tip that comes so deep again presses again; one so far above the surface has left it.
constexpr double kPressesAgain_mm = 0.2;
constexpr double kAway_mm = 0.6;
constexpr int kFewestFollowingPoints = 6;

}  // namespace

TipContact::TipContact(HoldAt hold_at, const Vec3& touch_mm, Grip grip)
    : hold_at_(std::move(hold_at)),
      held_(hold_at_(touch_mm)),
      touch_mm_(held_.footprint().center_mm),
      asked_for_(grip) {
  judge_.start(grip);
  release_.start();
}

std::vector<Vec3> TipContact::predicted(const HeldContact::Answer& answer, const std::vector<TissuePoint>& seen) const {
  std::vector<Vec3> rest;
  for (const TissuePoint& point : seen) rest.push_back(point.rest_mm);
  return displacement_at(held_.model(), held_.boundary(), answer.equilibrium.u, rest);
}

TipContact::Believed TipContact::believe(const Vec3& p, const std::vector<TissuePoint>& seen) {
  const auto with_prediction = [&](HeldContact::Answer answer) -> Believed {
    std::vector<Vec3> motion = predicted(answer, seen);
    return {std::move(answer), std::move(motion)};
  };
  if (judge_.grip() == Grip::grasp) return with_prediction(held_.grasp(p));
  if (judge_.grip() == Grip::push) return with_prediction(held_.push(p));
  Believed grasped = with_prediction(held_.grasp(p));
  Believed pushed = with_prediction(held_.push(p, &grasped.answer));
  judge_.update(seen, pushed.predicted_mm, grasped.predicted_mm);
  const bool has_pressed = pressed_frames_ >= kPressedFrames;
  const bool rather_pushes = judge_.grip() == Grip::push || judge_.evidence() < 0 ||
                             (judge_.evidence() == 0 && has_pressed && pushed.answer.let_go);
  return rather_pushes ? pushed : grasped;
}

TipContact::State TipContact::state_of(const HeldContact::Answer& answer, double height_mm) {
  pressed_frames_ += height_mm < -kPressed_mm;
  const bool has_pressed = pressed_frames_ >= kPressedFrames;
  if (!answer.let_go && !(lifted_ && height_mm > -kPressesAgain_mm)) {
    lifted_ = false;
    return State::touching;
  }
  if (height_mm > kAway_mm) return State::over;
  lifted_ = has_pressed;
  return lifted_ ? State::lifted : State::touching;
}

void TipContact::move_footprint() {
  held_ = hold_at_(held_.place_mm());
  release_.start();
}

TipContact::Answer TipContact::update(const Vec3& displacement_mm, const std::vector<TissuePoint>& seen,
                                      bool has_to_be_seen) {
  Answer result;
  result.tip_mm = touch_mm_ + displacement_mm;
  if (judge_.grip() == Grip::push && held_.has_left_its_footprint()) move_footprint();
  const Vec3 p = result.tip_mm - held_.footprint().center_mm;
  Believed believed = believe(p, seen);
  const Follow follow = compare_motion(seen, believed.predicted_mm);
  result.state = state_of(believed.answer, p.dot(held_.footprint().normal));
  const bool stays_behind = judge_.grip() != Grip::push && release_.update(result.tip_mm, seen, believed.predicted_mm);
  const bool cannot_tell = has_to_be_seen && follow.points < kFewestFollowingPoints;
  if (follow.let_go || stays_behind || cannot_tell) result.state = State::over;
  result.misfit_mm = follow.misfit_mm;
  result.slid = believed.answer.slid;
  result.equilibrium = std::move(believed.answer.equilibrium);
  return result;
}

}  // namespace palpate
