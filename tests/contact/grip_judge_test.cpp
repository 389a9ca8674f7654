#include "palpate/contact/grip_judge.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

/// Tissue around a contact at 90 mm in a frame in which a grasp would have moved it by `grasped_mm` at the tip and a
/// push by `pushed_mm`; `share` of the way from the push to the grasp is seen.
struct Frame {
  std::vector<TissuePoint> seen;
  std::vector<Vec3> pushed_mm, grasped_mm;

  Frame(const Vec3& at_push_mm, const Vec3& at_grasp_mm, double share, int number, int count = 40) {
    for (int i = 0; i < count; ++i) {
      const double angle = 0.5 * i, radius = 4 + 0.2 * i;
      pushed_mm.push_back(3 / radius * at_push_mm);
      grasped_mm.push_back(3 / radius * at_grasp_mm);
      const double phase = 3.1 * number;
      const Vec3 noise(0.02 * std::sin(7.0 * i + phase), 0.02 * std::cos(11.0 * i + phase), 0.2 * std::sin(5.0 * i));
      const Vec3 moved = pushed_mm.back() + share * (grasped_mm.back() - pushed_mm.back()) + noise;
      seen.push_back({i, {radius * std::cos(angle), radius * std::sin(angle), 90}, moved, 0.2});
    }
  }
};

/// What the judge says of a tip that presses by 2 mm and then goes sideways by 0.3 mm per frame, of which a push would
/// take the tissue along for 0.6 mm.
Grip judged(double share, int frames) {
  GripJudge judge;
  judge.start(Grip::automatic);
  for (int frame = 0; frame < frames; ++frame) {
    const double sideways_mm = 0.3 * frame;
    const Frame f({std::min(sideways_mm, 0.6), 0, 2}, {sideways_mm, 0, 2}, share, frame);
    judge.update(f.seen, f.pushed_mm, f.grasped_mm);
  }
  return judge.grip();
}

TEST(GripJudge, ATipThatSlidesOverTheTissuePushes) {
  EXPECT_EQ(judged(0, 10), Grip::push);
}

TEST(GripJudge, ATipThatTakesTheTissueAlongGrasps) {
  EXPECT_EQ(judged(1, 10), Grip::grasp);
}

TEST(GripJudge, TissueThatMovesLessOrMoreThanTheModelSaysChangesNothing) {
  for (const double share : {0.4, 0.7, 1.3}) EXPECT_EQ(judged(share, 20), Grip::grasp) << share;
  for (const double share : {-0.3, 0.12}) EXPECT_EQ(judged(share, 20), Grip::push) << share;
}

TEST(GripJudge, TissueThatMovesInBetweenTellsNothing) {
  EXPECT_EQ(judged(0.25, 20), Grip::automatic);
}

TEST(GripJudge, ANormalPressTellsNothing) {
  GripJudge judge;
  judge.start(Grip::automatic);
  for (int frame = 0; frame < 200; ++frame) {
    const Frame f({0, 0, 0.01 * frame}, {0, 0, 0.01 * frame}, 0.5, frame);
    judge.update(f.seen, f.pushed_mm, f.grasped_mm);
  }
  EXPECT_EQ(judge.grip(), Grip::automatic);
}

TEST(GripJudge, ADifferenceBelowTheNoiseTellsNothing) {
  GripJudge judge;
  judge.start(Grip::automatic);
  for (int frame = 0; frame < 100; ++frame) {
    const Frame f({0, 0, 1}, {frame % 2 ? 0.02 : -0.02, 0, 1}, frame % 3 ? 0 : 1, frame);
    judge.update(f.seen, f.pushed_mm, f.grasped_mm);
  }
  EXPECT_EQ(judge.grip(), Grip::automatic);
}

TEST(GripJudge, TooFewPointsTellNothing) {
  GripJudge judge;
  judge.start(Grip::automatic);
  for (int frame = 0; frame < 20; ++frame) {
    const Frame f({0, 0, 2}, {3, 0, 2}, 1, frame, 4);
    judge.update(f.seen, f.pushed_mm, f.grasped_mm);
  }
  EXPECT_EQ(judge.grip(), Grip::automatic);
}

TEST(GripJudge, OnceToldItStays) {
  GripJudge judge;
  judge.start(Grip::automatic);
  for (int frame = 0; frame < 60; ++frame) {
    const Frame f({0, 0, 2}, {2, 0, 2}, frame < 10 ? 1 : 0, frame);
    judge.update(f.seen, f.pushed_mm, f.grasped_mm);
    if (frame >= 5) {
      EXPECT_EQ(judge.grip(), Grip::grasp) << frame;
    }
  }
}

TEST(GripJudge, WhatTheSceneSaysIsNotJudged) {
  for (const Grip said : {Grip::grasp, Grip::push}) {
    GripJudge judge;
    judge.start(said);
    for (int frame = 0; frame < 20; ++frame) {
      const Frame f({0, 0, 2}, {2, 0, 2}, said == Grip::grasp ? 0 : 1, frame);
      judge.update(f.seen, f.pushed_mm, f.grasped_mm);
    }
    EXPECT_EQ(judge.grip(), said);
  }
}

}  // namespace
}  // namespace palpate
