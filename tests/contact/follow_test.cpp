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
    seen.push_back({i, {radius * std::cos(angle), radius * std::sin(angle), 90}, share * motion + noise, 0.2});
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

/// Frame in which a release shows when the tip stops taking the tissue along after `held_frames`, moving by `step_mm`
/// per frame across the ray throughout; -1 when none is seen in 20 frames.
int release_of(int held_frames, double step_mm, double share_while_held = 0.8) {
  ReleaseDetector release;
  release.start();
  for (int frame = 0; frame < 20; ++frame) {
    std::vector<TissuePoint> seen;
    std::vector<Vec3> predicted;
    for (int i = 0; i < 24; ++i) {
      const double angle = 0.5 * i, radius = 4 + 0.2 * i;
      const Vec3 per_mm = 4 / radius * Vec3(0.8, 0.6, 0);
      const Vec3 noise = 0.015 * Vec3(std::sin(7.0 * i + 3.1 * frame), std::cos(11.0 * i + 2.3 * frame), 0);
      const Vec3 followed = share_while_held * std::min(frame, held_frames) * step_mm * per_mm;
      predicted.push_back(frame * step_mm * per_mm);
      seen.push_back({i, {radius * std::cos(angle), radius * std::sin(angle), 90}, followed + noise, 0.2});
    }
    if (release.update(Vec3(0, 0, 90) + frame * step_mm * Vec3(0.8, 0.6, 0), seen, predicted)) return frame;
  }
  return -1;
}

TEST(Release, ShowsWithinTwoFramesWhileTheTissueIsStillFarFromRest) {
  EXPECT_GT(release_of(8, 0.4), 8);
  EXPECT_LE(release_of(8, 0.4), 10);
}

TEST(Release, OfASlowTipShowsOnceItsMotionTells) {
  EXPECT_GT(release_of(8, 0.15), 8);
  EXPECT_LE(release_of(8, 0.15), 12);
}

TEST(Release, IsNotSeenInTissueThatFollowsLessThanTheModelSays) {
  EXPECT_EQ(release_of(30, 0.4, 0.5), -1);
}

TEST(Release, IsNotSeenInATremorBelowTheNoise) {
  EXPECT_EQ(release_of(0, 0.01), -1);
}

TEST(Release, IsNotSeenWhenOnlyTheDepthOfTheTipWanders) {
  ReleaseDetector release;
  release.start();
  for (int frame = 0; frame < 20; ++frame) {
    std::vector<TissuePoint> seen;
    std::vector<Vec3> predicted;
    for (int i = 0; i < 24; ++i) {
      seen.push_back({i, {4 * std::cos(0.5 * i), 4 * std::sin(0.5 * i), 90}, Vec3::Zero(), 0.2});
      predicted.push_back(0.1 * frame * Vec3(0.5, 0.5, 1));
    }
    EXPECT_FALSE(release.update({0, 0, 90 + 0.3 * frame}, seen, predicted)) << frame;
  }
}

}  // namespace
}  // namespace palpate
