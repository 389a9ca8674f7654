#include "palpate/contact/tip_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {

namespace {

/// A tip has pressed when it was so deep in so many frames; before, it only touches, and retreats by its own noise.
constexpr double kPressed_mm = 0.3;
constexpr int kPressedFrames = 2;
/// A lifted tip that comes so deep again presses again; one so far above the surface has left it, unless it may still
/// turn out to take the tissue along.
constexpr double kPressesAgain_mm = 0.2;
/// A tip that goes back by so much from one frame to the next lifts where it is nearly back at the surface, or where
/// the tissue is seen to have come to rest: it has not moved, and a share of the predicted motion, one standard
/// deviation more, is less.
constexpr double kLiftStep_mm = 0.08, kNearlyBack_mm = 0.15, kRestingShare = 0.3, kResting_mm = 0.03;
/// Motion of the tissue from which its springing back is told from one that was hardly moved.
constexpr double kSprungFrom_mm = 0.15;
/// A step of the tip from one frame to the next that the tissue neither follows nor springs back from is an error of
/// measurement.
constexpr double kJump_mm = 0.5, kDisplaced_mm = 0.06, kStayingShare = 0.7;
/// Of a tracked point across the viewing ray, mm; so many neighbours share their errors.
constexpr double kPointDeviation_mm = 0.05;
constexpr double kPointsThatAgree = 6;
constexpr double kAway_mm = 0.6, kAwayUntold_mm = 1.5;
constexpr int kFewestFollowingPoints = 6;
/// A tip in the tissue that has risen by this in the last frames retreats; less may be noise of its depth.
constexpr double kRetreat_mm = 0.4;
constexpr size_t kRecentFrames = 4;
/// A tip that has come to rest does not go on like this without the tissue; where it does, before the tissue has ever
/// followed, it did not hold it yet.
constexpr double kUnsettledStep_mm = 0.3;
/// Motion of the tissue (root mean square over the points) that can be told from its noise.
constexpr double kTellingMotion_mm = 0.05;
/// Between what a push and what a grasp predicts: nearer to which one the tissue moves.
constexpr double kEvenShare = 0.25;
/// Of the predicted motion, seen for sure: the tissue follows.
constexpr double kFollowingShare = 0.3;
/// Tissue beneath a push moves as the push says by more than this, or the tip is no longer there.
constexpr double kLeastPushedShare = 0.15;

/// How far the share of the predicted motion that the tissue shows may be off: one standard deviation.
double deviation_of_share(const Follow& follow) {
  if (follow.points < kFewestFollowingPoints) return std::numeric_limits<double>::infinity();
  return kPointDeviation_mm / (std::sqrt(follow.points / kPointsThatAgree) * follow.predicted_mm);
}

/// Tissue springs back when it is let go: where it is displaced as predicted, something holds it.
bool is_displaced(const Follow& follow) {
  return follow.share - 2 * deviation_of_share(follow) > kEvenShare;
}

}  // namespace

TipContact::TipContact(HeldContact held, Grip grip)
    : held_(std::move(held)), touch_mm_(held_.footprint().center_mm + held_.displaced_at_begin_mm()), asked_for_(grip) {
  judge_.start(grip);
  release_.start();
}

std::vector<Vec3> TipContact::predicted(const HeldContact::Answer& answer, const std::vector<TissuePoint>& seen) {
  const auto displacement = [&](const std::vector<Vec3>& rest_mm) {
    return displacement_at(held_.body().model(), held_.body().boundary(), answer.equilibrium.u, rest_mm);
  };
  std::vector<Vec3> rest;
  for (const TissuePoint& point : seen) rest.push_back(point.rest_mm);
  if (held_.displaced_at_begin_mm().isZero()) return displacement(rest);

  // Where another tip had moved the tissue when this one touched, points were first seen off their rest.
  const std::vector<Vec3> moved = displacement(rest);
  for (size_t i = 0; i < seen.size(); ++i) {
    const Vec3 before_mm = moved[i] - seen[i].displacement_mm;
    rest[i] = origins_.try_emplace(seen[i].number, Origin{rest[i] - before_mm, before_mm}).first->second.rest_mm;
  }
  std::vector<Vec3> motion = displacement(rest);
  for (size_t i = 0; i < seen.size(); ++i) motion[i] -= origins_.at(seen[i].number).displacement_mm;
  return motion;
}

TipContact::Believed TipContact::grasped(const Vec3& p_mm, const std::vector<TissuePoint>& seen) {
  HeldContact::Answer answer = held_.grasp(p_mm);
  std::vector<Vec3> motion = predicted(answer, seen);
  if_held_ = compare_motion(seen, motion);
  return {std::move(answer), std::move(motion)};
}

TipContact::Believed TipContact::pushed(const Vec3& p_mm, const std::vector<TissuePoint>& seen,
                                        const HeldContact::Answer* tied) {
  HeldContact::Answer answer = held_.push(p_mm, tied);
  std::vector<Vec3> motion = predicted(answer, seen);
  return {std::move(answer), std::move(motion)};
}

TipContact::Believed TipContact::believe(const Vec3& p_mm, const std::vector<TissuePoint>& seen) {
  pushes_ = judge_.grip() == Grip::push;
  if (pushes_) return pushed(p_mm, seen);
  Believed if_grasped = grasped(p_mm, seen);
  if (judge_.grip() == Grip::grasp) return if_grasped;
  Believed if_pushed = pushed(p_mm, seen, &if_grasped.answer);
  judge_.update(seen, if_pushed.predicted_mm, if_grasped.predicted_mm);
  if (judge_.grip() != Grip::automatic) {
    pushes_ = judge_.grip() == Grip::push;
  } else {
    // Nothing has told yet: a tip that has pressed and goes back lifts, any other that goes back pulls.
    const double share = judge_.share().value_or(has_pressed() && if_pushed.answer.let_go ? 0 : 1);
    pushes_ = share < kEvenShare;
  }
  return pushes_ ? if_pushed : if_grasped;
}

bool TipContact::has_pressed() const {
  return pressed_frames_ >= kPressedFrames;
}

/// Tissue cannot stay behind a tip that stays in it, whatever a law that gives way there predicts; but it is seen when
/// it springs back.
bool TipContact::stays_in_tissue(double height_mm, const Follow& follow) {
  recent_.push_back({height_mm, follow.seen_mm});
  if (recent_.size() > kRecentFrames) recent_.pop_front();
  double deepest_mm = height_mm, farthest_mm = 0;
  for (const Recent& frame : recent_) {
    deepest_mm = std::min(deepest_mm, frame.height_mm);
    farthest_mm = std::max(farthest_mm, frame.seen_mm);
  }
  const bool springs_back = farthest_mm > kSprungFrom_mm && follow.seen_mm < kResting_mm;
  return height_mm < -kPressed_mm && height_mm - deepest_mm < kRetreat_mm && !springs_back;
}

bool TipContact::lifts(const Follow& follow, double height_mm) const {
  if (!has_pressed() || height_mm - last_height_mm_ < kLiftStep_mm) return false;
  if (height_mm > -kNearlyBack_mm) return true;
  return follow.seen_mm < kResting_mm && follow.share + deviation_of_share(follow) < kRestingShare;
}

TipContact::State TipContact::state_of_push(const HeldContact::Answer& answer, const Follow& follow, double height_mm) {
  const bool stays_lifted = lifted_ && height_mm > -kPressesAgain_mm;
  if (!answer.let_go && !stays_lifted && !lifts(follow, height_mm)) {
    lifted_ = false;
    return State::touching;
  }
  if (height_mm > (judge_.grip() == Grip::push ? kAway_mm : kAwayUntold_mm)) return State::over;
  lifted_ = has_pressed();
  return lifted_ ? State::lifted : State::touching;
}

/// Tangential over normal force; 0 where it does not press.
double TipContact::friction_of(const HeldContact::Answer& answer) const {
  const Vec3 &force_N = answer.equilibrium.force_N, &normal = held_.footprint().normal;
  const double normal_N = -force_N.dot(normal);
  return normal_N > 0 ? (force_N + normal_N * normal).norm() / normal_N : 0;
}

bool TipContact::is_unsettled(const Vec3& displacement_mm, const Follow& if_held, const Follow& as_believed) const {
  return !followed_ && asked_for_ != Grip::push && (asked_for_ == Grip::grasp || !has_pressed()) &&
         (displacement_mm - last_displacement_mm_).norm() > kUnsettledStep_mm &&
         if_held.predicted_mm > kTellingMotion_mm && if_held.share < kEvenShare && as_believed.share < kEvenShare;
}

/// The tip jumped, and the tissue stays as displaced as it was: it would have come along or sprung back. Once, that is:
/// a tip that goes on like this leaves tissue that something else keeps displaced.
bool TipContact::is_jump_of_measurement(const Vec3& displacement_mm, const Follow& follow) const {
  const Vec3 step_mm = displacement_mm - last_displacement_mm_;
  return judge_.grip() == Grip::grasp && step_mm.norm() > kJump_mm && step_mm.dot(last_jump_mm_) <= 0 &&
         follow.points >= kFewestFollowingPoints && follow.seen_mm > kDisplaced_mm &&
         follow.seen_mm > kStayingShare * last_seen_mm_;
}

TipContact::Answer TipContact::update(const Vec3& measured_mm, const std::vector<TissuePoint>& seen,
                                      bool has_to_be_seen) {
  Vec3 displacement_mm = measured_mm - jumped_mm_;
  Answer result;
  result.tip_mm = touch_mm_ + displacement_mm;
  if (judge_.grip() == Grip::push && held_.has_left_its_footprint()) {
    held_.move_footprint();
    release_.start();
  }
  const Vec3 p_mm = result.tip_mm - held_.footprint().center_mm;
  const double height_mm = p_mm.dot(held_.footprint().normal);
  ++frames_;
  pressed_frames_ += height_mm < -kPressed_mm;
  Believed believed = believe(p_mm, seen);
  Follow follow = compare_motion(seen, believed.predicted_mm);
  followed_ |= follow.share - deviation_of_share(follow) > kFollowingShare;
  const bool unsettled = is_unsettled(displacement_mm, if_held_, believed.answer.let_go ? if_held_ : follow);
  bool let_go = false;
  const bool may_slip = asked_for_ == Grip::automatic && height_mm < -kPressed_mm;
  if (judge_.grip() == Grip::grasp)
    let_go = follow.let_go |
             (release_.update(result.tip_mm, seen, believed.predicted_mm) && (may_slip || !is_displaced(follow)));
  else if (pushes_ && !believed.answer.let_go)
    let_go = follow.let_go && follow.share < kLeastPushedShare;
  if (stays_in_tissue(height_mm, follow) && (asked_for_ == Grip::grasp || (pushes_ && followed_))) let_go = false;
  let_go |= has_to_be_seen && follow.points < kFewestFollowingPoints;
  const bool jumped = let_go && !may_slip && is_jump_of_measurement(displacement_mm, follow);
  last_jump_mm_ = jumped ? Vec3(displacement_mm - last_displacement_mm_) : Vec3::Zero();
  if (jumped) {
    jumped_mm_ += last_jump_mm_;
    displacement_mm = last_displacement_mm_;
    result.tip_mm = touch_mm_ + displacement_mm;
    believed = grasped(result.tip_mm - held_.footprint().center_mm, seen);
    follow = compare_motion(seen, believed.predicted_mm);
    let_go = false;
  }
  last_seen_mm_ = follow.seen_mm;
  last_displacement_mm_ = displacement_mm;
  // A tip that loses hold of the tissue while it presses on it slides: what held it so far was friction.
  if (let_go && judge_.grip() == Grip::grasp && may_slip) {
    judge_.start(Grip::push);
    held_.raise_friction(held_friction_);
    pushes_ = true;
    believed = pushed(p_mm, seen);
    let_go = false;
  }
  held_friction_ = friction_of(believed.answer);
  if (pushes_) {
    result.state = state_of_push(believed.answer, follow, height_mm);
  } else {
    lifted_ = false;
  }
  last_height_mm_ = height_mm;
  if (let_go) result.state = State::over;
  if (unsettled) result.state = State::unsettled;
  result.misfit_mm = follow.misfit_mm;
  result.slid = believed.answer.slid;
  result.tied_mm = believed.answer.tied_mm;
  result.equilibrium = std::move(believed.answer.equilibrium);
  return result;
}

}  // namespace palpate
