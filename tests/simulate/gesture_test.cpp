#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "palpate/core/errors.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/uterus_demo.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

SimulateOptions read(const std::string& yaml) {
  SimulateOptions options;
  Settings settings;
  describe(settings, options);
  read_settings(YAML::Load(yaml), {"scene.yaml", "/data"}, settings, "simulate.");
  return options;
}

std::string complaint(const std::string& yaml) {
  try {
    read(yaml);
  } catch (const BadInput& error) {
    return error.what();
  }
  return "";
}

const std::string kGesture = R"(
gesture:
  - {approach_s: 0.6, at_px: [400, 180], footprint_radius_mm: 3}
  - {grasp: true}
  - {move_mm: [2, 0.5, 0], during_s: 0.7}
  - {hold_s: 0.2}
  - {move_mm: [-1, 0, 0], during_s: 0.5}
  - {release: true, leave_s: 0.4}
)";

TEST(Gesture, ReachesTheStatedPlacesAtRowEnds) {
  const auto rows = read(kGesture).gesture;
  EXPECT_NEAR(gesture_duration_s(rows), 2.4, 1e-12);
  EXPECT_DOUBLE_EQ(gesture_at(rows, 0).away, 1);
  EXPECT_NEAR(gesture_at(rows, 0.6).away, 0, 1e-12);
  EXPECT_NEAR((gesture_at(rows, 1.3).move_mm - Vec3(2, 0.5, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((gesture_at(rows, 1.5).move_mm - Vec3(2, 0.5, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((gesture_at(rows, 2.0).move_mm - Vec3(-1, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(gesture_at(rows, 2.4).away, 1, 1e-12);
  EXPECT_NEAR(gesture_at(rows, 9).away, 1, 1e-12);
}

TEST(Gesture, BeginsTheContactWithoutDisplacementAndEndsItWhenTheReleaseShows) {
  const auto rows = read(kGesture).gesture;
  EXPECT_FALSE(gesture_at(rows, 0.6 - 1e-6).in_contact);
  EXPECT_TRUE(gesture_at(rows, 0.6).in_contact);
  EXPECT_LT(gesture_at(rows, 0.6).move_mm.norm(), 1e-12);
  const GesturePose last = gesture_at(rows, 2.0), next = gesture_at(rows, 2.04);
  EXPECT_TRUE(last.in_contact);
  EXPECT_NEAR(last.opening, 0, 1e-12);
  EXPECT_NEAR(last.away, 0, 1e-12);
  EXPECT_FALSE(next.in_contact);
  EXPECT_GT(next.opening, 0);
  EXPECT_GT(next.away, 0);
}

TEST(Gesture, TouchesOnTheFrameThatTheRowsName) {
  const auto rows = uterus_demo().simulate.gesture;
  int first = -1;
  for (int frame = 0; frame < 40 && first < 0; ++frame)
    if (gesture_at(rows, frame / 25.0).in_contact) first = frame;
  EXPECT_EQ(first, 15);
}

// Minimum jerk between rests: no jump in place, velocity or acceleration anywhere, also not across row ends.
TEST(Gesture, IsSmoothWhileTheTissueIsHeld) {
  const auto rows = read(kGesture).gesture;
  const double dt = 1e-3;
  const double largest_jerk = 60 * 3 / std::pow(0.5, 3);  // 60 d / T^3 of the fastest move, 3 mm in 0.5 s
  for (double t = 0.62; t < 1.98; t += dt) {
    const auto at = [&](double s) { return gesture_at(rows, s).move_mm; };
    const Vec3 jerk = (at(t + 2 * dt) - 3 * at(t + dt) + 3 * at(t) - at(t - dt)) / (dt * dt * dt);
    EXPECT_LT(jerk.norm(), 1.1 * largest_jerk) << "at " << t << " s";
  }
}

TEST(Gesture, ComesToTheTissueWithoutSpeed) {
  const auto rows = read(kGesture).gesture;
  const double speed = (gesture_at(rows, 0.6).away - gesture_at(rows, 0.599).away) / 0.001;
  EXPECT_NEAR(speed, 0, 1e-3);
}

TEST(Gesture, OpensItsJawsOnlyWhenFree) {
  const auto rows = read(kGesture).gesture;
  EXPECT_NEAR(gesture_at(rows, 0.1).opening, 1, 1e-9);
  EXPECT_NEAR(gesture_at(rows, 0.6).opening, 0, 1e-9);
  EXPECT_NEAR(gesture_at(rows, 1.9).opening, 0, 1e-9);
  EXPECT_NEAR(gesture_at(rows, 2.4).opening, 1, 1e-9);
}

TEST(GestureKeys, RefuseWhatIsNotAGesture) {
  EXPECT_THAT(complaint("gesture: [{grasp: true}]"), HasSubstr("row 1: grasp has to follow approach_s"));
  EXPECT_THAT(complaint("gesture: [{approach_s: 1, at_px: [1, 1]}, {hold_s: 1, grasp: true}]"),
              HasSubstr("row 2: 2 of approach_s"));
  EXPECT_THAT(complaint("gesture: [{approach_s: 1, at_px: [1, 1]}, {move_mm: [1, 0, 0], during_s: 1}]"),
              HasSubstr("between grasp or push and release"));
  EXPECT_THAT(complaint("gesture: [{approach_s: 1, at_px: [1, 1]}, {move_mm: [1, 0, 0]}]"), HasSubstr("row 2"));
  EXPECT_THAT(complaint("gesture: [{approach_s: 1, at_px: [1, 1]}, {release: true}]"),
              HasSubstr("release without a grasp or push"));
  EXPECT_THAT(complaint("gesture: [{hold_s: 1}]"), HasSubstr("approach_s"));
  EXPECT_THAT(complaint("gesture: [{aproach_s: 1}]"), HasSubstr("approach_s"));
}

TEST(Gesture, OfAPushKeepsTheJawsClosedAndIsOneContact) {
  const std::string push =
      "gesture: [{approach_s: 1, at_px: [1, 1]}, {push: true}, {move_mm: [-1, 3, 4], during_s: 1}, {release: true}]";
  const auto rows = read(push).gesture;
  EXPECT_TRUE(is_push(rows));
  EXPECT_FALSE(is_push(read(kGesture).gesture));
  EXPECT_DOUBLE_EQ(longest_drag_mm(rows), 5);
  EXPECT_TRUE(gesture_at(rows, 1.5).in_contact);
  for (const double t : {0.1, 1.0, 1.9, 2.0}) EXPECT_EQ(gesture_at(rows, t).opening, 0);
  EXPECT_THAT(complaint("gesture: [{approach_s: 1, at_px: [1, 1]}, {grasp: true}, {push: true}]"),
              HasSubstr("row 3: push has to follow approach_s, once"));
}

TEST(SimulateKeys, TakeAShapeByWordOrByFile) {
  EXPECT_EQ(read("{body: {shape: heart}," + kGesture.substr(1, 8) + " [{approach_s: 1, at_px: [1, 1]}]}").body.shape,
            "heart");
  EXPECT_EQ(read("{body: {shape: organ.msh}, gesture: [{approach_s: 1, at_px: [1, 1]}]}").body.shape,
            "/data/organ.msh");
  EXPECT_THAT(complaint("body: {shape: paer}"), HasSubstr("did you mean \"pear\""));
}

TEST(SimulateKeys, ComeBackAsTheyWereWritten) {
  SimulateOptions demo = uterus_demo().simulate;
  Settings settings;
  describe(settings, demo);
  const SimulateOptions again = read(write_settings(settings));
  EXPECT_EQ(again.body.shape, "pear");
  EXPECT_EQ(again.body.center_mm, demo.body.center_mm);
  ASSERT_EQ(again.gesture.size(), demo.gesture.size());
  for (double t = 0; t < gesture_duration_s(demo.gesture); t += 0.07)
    EXPECT_NEAR((gesture_at(again.gesture, t).move_mm - gesture_at(demo.gesture, t).move_mm).norm(), 0, 1e-9);
}

}  // namespace
}  // namespace palpate
