#include "palpate/contact/tip_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/meshes.h"

namespace palpate {
namespace {

using State = TipContact::State;

constexpr double kRadius_mm = 4, kFriction = 0.3;

/// A block clamped at z = 20 whose top face z = 0 looks at a camera 90 mm away, and a tip on it; the tissue is what
/// another contact with the true grip says.
class Scene {
 public:
  explicit Scene(Grip true_grip, Grip told = Grip::automatic, double true_friction = kFriction)
      : contact_(held(kFriction), told), truth_(held(true_friction), true_grip) {}

  /// The tip goes to `p_mm` from where it touched (z: into the tissue); the tissue goes where the truth says.
  TipContact::Answer move(const Vec3& p_mm) {
    true_answer_ = truth_.update(p_mm, {});
    return contact_.update(p_mm, tissue(true_answer_.state == State::touching));
  }
  /// The tip moves, the tissue is at rest.
  TipContact::Answer move_alone(const Vec3& p_mm) { return contact_.update(p_mm, tissue(false)); }
  /// The tip moves, the tissue stays where it was moved to.
  TipContact::Answer move_on(const Vec3& p_mm) { return contact_.update(p_mm, tissue(true)); }

  const TipContact& contact() const { return contact_; }
  const Vec3& true_force_N() const { return true_answer_.equilibrium.force_N; }

 private:
  HeldContact held(double friction) const {
    ContactOptions options;
    options.friction = friction;
    options.footprint_radius_mm = kRadius_mm;
    const auto as_it_is = [mesh = mesh_, clamped = clamped_](const std::vector<Vec3>&) -> AttachedMesh {
      return {mesh, clamped};
    };
    const TissueOptions tissue{Law::neo_hookean, 27, 0.45, ""};
    const auto body = std::make_shared<TouchedBody>(as_it_is, tissue, Element::averaged, kRadius_mm);
    return HeldContact(body, touch_mm_, options);
  }

  std::vector<TissuePoint> tissue(bool is_touched) {
    ++frame_;
    std::vector<TissuePoint> seen;
    std::vector<Vec3> at;
    for (int i = 0; i < 40; ++i) {
      const double angle = 2.4 * i, radius = 1.3 * kRadius_mm + 0.15 * i;
      at.push_back(touch_mm_ + radius * Vec3(std::cos(angle), std::sin(angle), 0));
    }
    std::vector<Vec3> moved(at.size(), Vec3::Zero());
    const HeldContact& truth = truth_.held();
    if (is_touched)
      moved = displacement_at(truth.body().model(), truth.body().boundary(), true_answer_.equilibrium.u, at);
    for (size_t i = 0; i < at.size(); ++i) {
      const double phase = 7.0 * static_cast<double>(i) + 3.1 * frame_;
      const Vec3 noise(0.02 * std::sin(phase), 0.02 * std::cos(1.7 * phase), 0.15 * std::sin(2.3 * phase));
      seen.push_back({static_cast<int>(i), at[i], moved[i] + noise, 0.2});
    }
    return seen;
  }

  TetMesh mesh_ = moved_away(test::box_mesh({48, 40, 20}, {12, 10, 5}));
  std::vector<int> clamped_ = test::nodes_at(mesh_, 2, 110);
  Vec3 touch_mm_{0, 0, 90};
  TipContact contact_, truth_;
  TipContact::Answer true_answer_;
  int frame_ = 0;

  static TetMesh moved_away(TetMesh mesh) {
    for (Vec3& node : mesh.nodes_mm) node += Vec3(-20, -20, 90);
    return mesh;
  }
};

/// Presses by 2 mm, goes 6 mm sideways, then back to `end_mm` above the surface.
std::vector<Vec3> press_drag_lift(double end_mm) {
  std::vector<Vec3> path = {Vec3::Zero()};
  for (int i = 1; i <= 8; ++i) path.push_back({0, 0, 0.25 * i});
  for (int i = 1; i <= 20; ++i) path.push_back({0.3 * i, 0, 2});
  for (int i = 1; i <= 10; ++i) path.push_back({6, 0, 2 - (2 + end_mm) * 0.1 * i});
  return path;
}

TEST(TipContact, AutoGivesTheForceOfTheTrueGripWhileItSlidesAndWhileItDrags) {
  for (const Grip true_grip : {Grip::push, Grip::grasp}) {
    Scene scene(true_grip);
    double peak_N = 0, largest_error_N = 0;
    for (const Vec3& p : press_drag_lift(0)) {
      const TipContact::Answer answer = scene.move(p);
      if (p.z() > 0.3) {
        ASSERT_EQ(answer.state, State::touching);
      }
      peak_N = std::max(peak_N, scene.true_force_N().norm());
      largest_error_N = std::max(largest_error_N, (answer.equilibrium.force_N - scene.true_force_N()).norm());
    }
    EXPECT_EQ(scene.contact().grip(), true_grip);
    EXPECT_LT(largest_error_N, 0.15 * peak_N) << "until it could be told";
  }
}

TEST(TipContact, APushThatSlidesFarTakesItsFootprintAlongWithoutAJumpOfForce) {
  Scene scene(Grip::push, Grip::push);
  const Vec3 first_mm = scene.contact().held().footprint().center_mm;
  Vec3 before_N = Vec3::Zero();
  bool was_sliding = false;
  for (const Vec3& p : press_drag_lift(0.5)) {
    const TipContact::Answer answer = scene.move(p);
    if (was_sliding && answer.slid && p.z() == 2) {
      EXPECT_LT((answer.equilibrium.force_N - before_N).norm(), 0.06 * before_N.norm()) << p.transpose();
    }
    was_sliding = answer.slid;
    before_N = answer.equilibrium.force_N;
    const HeldContact& held = scene.contact().held();
    EXPECT_LT((held.footprint().center_mm - held.place_mm()).norm(), kRadius_mm);
  }
  EXPECT_GT((scene.contact().held().footprint().center_mm - first_mm).norm(), kRadius_mm);
}

TEST(TipContact, APressThatLiftsNeverPulls) {
  for (const Grip told : {Grip::automatic, Grip::push}) {
    Scene scene(Grip::push, told);
    State last = State::touching;
    for (int i = 0; i <= 45; ++i) {
      const double depth_mm = i < 20 ? 0.1 * i : 2 - 0.15 * (i - 20);
      if (last == State::over) break;
      const TipContact::Answer answer = scene.move({0, 0, depth_mm});
      last = answer.state;
      if (depth_mm < 0 && i > 20) {
        EXPECT_NE(answer.state, State::touching) << depth_mm;
      }
      if (depth_mm > 0.2 || (i < 20 && depth_mm > 0.05)) {
        EXPECT_EQ(answer.state, State::touching) << depth_mm;
        EXPECT_NEAR(answer.equilibrium.force_N.z(), scene.true_force_N().z(), 0.02) << depth_mm;
      }
    }
    EXPECT_EQ(last, State::over);
  }
}

TEST(TipContact, ATipThatLiftsIsOffTheTissueOnceThatIsSeenAtRestHoweverDeepTheTipIsThoughtToBe) {
  for (const Grip told : {Grip::automatic, Grip::push}) {
    Scene scene(Grip::push, told);
    for (int i = 0; i <= 20; ++i) scene.move({0.04 * i, 0, 0.1 * i});
    for (int i = 1; i <= 5; ++i) EXPECT_EQ(scene.move({0.8, 0, 2 - 0.25 * i}).state, State::touching) << i;
    EXPECT_EQ(scene.move_alone({0.8, 0, 0.6}).state, State::lifted);
    EXPECT_EQ(scene.move({0.8, 0, 1.2}).state, State::touching) << "presses again";
  }
}

TEST(TipContact, ATipThatRetreatsAndTakesTheTissueAlongGrasps) {
  Scene scene(Grip::grasp);
  for (int i = 0; i <= 15; ++i) {
    const TipContact::Answer answer = scene.move({0, 0, -0.2 * i});
    ASSERT_EQ(answer.state, State::touching) << i;
    EXPECT_LT((answer.equilibrium.force_N - scene.true_force_N()).norm(), 0.01) << i;
  }
  EXPECT_EQ(scene.contact().grip(), Grip::grasp);
}

TEST(TipContact, ATipThatRetreatsAndLeavesTheTissueHasLetGo) {
  for (const Grip told : {Grip::automatic, Grip::grasp}) {
    Scene scene(Grip::grasp, told);
    for (int i = 0; i <= 10; ++i) ASSERT_EQ(scene.move({0.15 * i, 0, -0.1 * i}).state, State::touching);
    int frames = 0;
    while (scene.move_alone({1.5 + 0.4 * frames, 0, -1 - 0.1 * frames}).state == State::touching)
      ASSERT_LT(++frames, 3);
  }
}

TEST(TipContact, AGraspThatGoesOnIntoTheTissueHasNotLetGo) {
  Scene scene(Grip::grasp, Grip::grasp);
  for (int i = 0; i <= 10; ++i) ASSERT_EQ(scene.move({0.05 * i, 0, 0.15 * i}).state, State::touching);
  for (int i = 1; i <= 5; ++i) EXPECT_EQ(scene.move_on({0.5 + 0.3 * i, 0, 1.5 + 0.02 * i}).state, State::touching) << i;
}

TEST(TipContact, AGraspThatPressedHasLetGoWhereTheTissueSpringsBack) {
  Scene scene(Grip::grasp, Grip::grasp);
  for (int i = 0; i <= 10; ++i) ASSERT_EQ(scene.move({0.2 * i, 0, 0.06 * i}).state, State::touching);
  EXPECT_EQ(scene.move_alone({2.3, 0, 0.5}).state, State::over);
}

TEST(TipContact, AGraspIsNotLetGoByATipThatIsMeasuredBadlyWhileTheTissueStaysDisplaced) {
  Scene scene(Grip::grasp, Grip::grasp);
  for (int i = 0; i <= 10; ++i) ASSERT_EQ(scene.move({0.2 * i, 0, -0.2 * i}).state, State::touching);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(scene.move_on({2 + (i % 2 ? 0.3 : 0.0), 0, -2.0}).state, State::touching) << i;
}

TEST(TipContact, AJumpOfTheMeasuredTipThatTheTissueDoesNotMakeIsNoneOfTheTip) {
  Scene scene(Grip::grasp, Grip::grasp);
  for (int i = 0; i <= 8; ++i) ASSERT_EQ(scene.move({0.2 * i, 0, -0.2 * i}).state, State::touching);
  for (int i = 0; i < 4; ++i) {
    const TipContact::Answer answer = scene.move_on({1.6, i < 2 ? 6.0 : 0.0, -1.6});
    ASSERT_EQ(answer.state, State::touching) << i;
    EXPECT_LT((answer.equilibrium.force_N - scene.true_force_N()).norm(), 0.05 * scene.true_force_N().norm()) << i;
  }
  EXPECT_EQ(scene.move_alone({1.8, 0, -1.6}).state, State::over);
}

TEST(TipContact, ATipThatGoesFartherAndFartherFromTissueThatStaysDisplacedHasLetGo) {
  Scene scene(Grip::grasp, Grip::grasp);
  for (int i = 0; i <= 8; ++i) ASSERT_EQ(scene.move({0.2 * i, 0, -0.2 * i}).state, State::touching);
  int frames = 0;
  while (scene.move_on({1.6 + 2.0 * (frames + 1), 0, -1.6 - 1.0 * frames}).state == State::touching)
    ASSERT_LT(++frames, 4);
}

TEST(TipContact, AGraspBeginsAnewWhenItsTipGoesOnBeforeTheTissueHasEverFollowed) {
  for (const double into_mm : {1.0, -1.0}) {
    Scene scene(Grip::grasp, Grip::grasp);
    for (int i = 0; i < 8; ++i) ASSERT_EQ(scene.move_alone({0, 0, 0.01 * i}).state, State::touching);
    EXPECT_EQ(scene.move_alone({0, 0, into_mm}).state, State::unsettled) << into_mm;
  }
}

TEST(TipContact, ATipThatTremblesOnTheSurfaceKeepsTouching) {
  for (const Grip told : {Grip::automatic, Grip::push, Grip::grasp}) {
    Scene scene(Grip::push, told);
    for (int i = 0; i < 40; ++i) {
      const TipContact::Answer answer = scene.move({0.03 * std::sin(1.3 * i), 0, 0.1 * std::sin(2.1 * i)});
      EXPECT_EQ(answer.state, State::touching) << i;
      EXPECT_LT(answer.equilibrium.force_N.norm(), 0.1) << i;
    }
  }
}

TEST(TipContact, JawsThatStillCloseAreNoPull) {
  for (const Grip told : {Grip::automatic, Grip::grasp}) {
    Scene scene(Grip::grasp, told);
    EXPECT_EQ(scene.move_alone(Vec3::Zero()).state, State::touching);
    EXPECT_EQ(scene.move_alone({0.9, 0.3, 0.4}).state, State::unsettled);
  }
}

TEST(TipContact, FrictionToldTooHighLosesNoContact) {
  Scene scene(Grip::push, Grip::automatic, 0.05);
  for (const Vec3& p : press_drag_lift(0)) {
    const Vec3 trembling = p + Vec3(0, 0, std::min(p.z(), 0.06) * std::sin(40 * p.x()));
    const TipContact::Answer answer = scene.move(trembling);
    if (p.z() > 0.6) {
      EXPECT_EQ(answer.state, State::touching) << p.transpose();
    }
  }
}

TEST(TipContact, FrictionToldTooLowIsMadeUpForByWhatIsSeen) {
  constexpr double kTrueFriction = 0.6;
  Scene scene(Grip::push, Grip::automatic, kTrueFriction);
  double peak_N = 0, error_at_the_end_N = 0;
  for (const Vec3& p : press_drag_lift(0)) {
    const TipContact::Answer answer = scene.move(p);
    if (p.z() < 2) continue;
    ASSERT_EQ(answer.state, State::touching) << p.transpose();
    peak_N = std::max(peak_N, scene.true_force_N().norm());
    error_at_the_end_N = (answer.equilibrium.force_N - scene.true_force_N()).norm();
  }
  EXPECT_EQ(scene.contact().grip(), Grip::push);
  EXPECT_LT(error_at_the_end_N, 0.1 * peak_N);
}

TEST(TipContact, ATipThatPressesFirstAndThenPullsIsFoundToHold) {
  Scene scene(Grip::grasp);
  int frames_without_force = 0;
  for (int i = 0; i <= 40; ++i) {
    const TipContact::Answer answer = scene.move({0, 0, i <= 10 ? 0.2 * i : 2 - 0.2 * (i - 10)});
    ASSERT_NE(answer.state, State::over) << i;
    frames_without_force += answer.state != State::touching;
    if (i > 28) {
      EXPECT_LT((answer.equilibrium.force_N - scene.true_force_N()).norm(), 0.01) << i;
    }
  }
  EXPECT_EQ(scene.contact().grip(), Grip::grasp);
  EXPECT_LE(frames_without_force, 6);
}

}  // namespace
}  // namespace palpate
