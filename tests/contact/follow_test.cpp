#include "palpate/contact/follow.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// A ring of points at 90 mm whose predicted motion falls off from the middle; `share` of it is seen.
Follow follow_of(double share, double size_mm, int count = 24) {
  std::vector<TissuePoint> seen;
  std::vector<Vec3> predicted;
  for (int i = 0; i < count; ++i) {
    const double angle = 0.5 * i, radius = 4 + 0.2 * i;
    const Vec3 motion = size_mm * 4 / radius * Vec3(0.6, 0.2, -0.7);
    predicted.push_back(motion);
    const Vec3 noise = 0.03 * Vec3(std::sin(7.0 * i), std::cos(11.0 * i), 0);
    seen.push_back({{radius * std::cos(angle), radius * std::sin(angle), 90}, share * motion + noise, 0.2});
  }
  return compare_motion(seen, predicted);
}

TEST(Follow, TissueThatMovesAsPredictedIsHeld) {
  const Follow follow = follow_of(1, 2);
  EXPECT_FALSE(follow.let_go);
  EXPECT_NEAR(follow.share, 1, 0.05);
  EXPECT_LT(follow.misfit_mm, 0.05);
}

TEST(Follow, TissueThatStaysAtRestWhileTheTipLeavesHasBeenLetGo) {
  EXPECT_TRUE(follow_of(0, 2).let_go);
}

TEST(Follow, AStiffnessSlightlyOffIsNoRelease) {
  EXPECT_FALSE(follow_of(0.7, 2).let_go);
}

TEST(Follow, MotionTooSmallToTellIsNoRelease) {
  EXPECT_FALSE(follow_of(0, 0.05).let_go);
}

TEST(Follow, TooFewPointsCannotTell) {
  EXPECT_FALSE(follow_of(0, 2, 4).let_go);
}

}  // namespace
}  // namespace palpate
