#include "palpate/contact/onset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace palpate {
namespace {

constexpr double kThreshold_mm = 1.5, kDeviation_mm = 0.3;

/// First frame with contact of a tip that moves along the normal of a plane at z = 90 mm, towards the camera at the
/// origin; -1 when there is none.
int onset_of(const std::vector<double>& gaps_mm) {
  OnsetDetector onset(kThreshold_mm);
  for (size_t i = 0; i < gaps_mm.size(); ++i)
    if (onset.update(gaps_mm[i], kDeviation_mm, {5, 5, 90 - gaps_mm[i]})) return static_cast<int>(i);
  return -1;
}

TEST(Onset, ATipThatComesToRestOnTheSurfaceTouches) {
  EXPECT_EQ(onset_of({8, 6, 4, 2, 1, 0.1, 0.05, 0}), 6);
}

TEST(Onset, ATipThatHoversAboveTheThresholdNeverTouches) {
  EXPECT_EQ(onset_of({8, 6, 4, 3, 3, 3, 3, 3, 3, 3}), -1);
}

TEST(Onset, ATipThatHoversAtThreeMillimetresNeverTouchesHoweverBadlyItIsKnown) {
  for (double deviation_mm : {0.1, 0.5, 1.0, 3.0}) {
    OnsetDetector onset(kThreshold_mm);
    for (int frame = 0; frame < 200; ++frame) {
      const double tremor = 0.3 * std::sin(0.9 * frame);
      const double gap_mm = frame < 5 ? 9 - frame : 3 + tremor;
      EXPECT_FALSE(onset.update(gap_mm, deviation_mm, {5, 5 + tremor, 90 - gap_mm})) << frame << ' ' << deviation_mm;
    }
  }
}

TEST(Onset, ATipOnItsWayPastTheSurfaceDoesNotTouch) {
  EXPECT_EQ(onset_of({6, 4, 2.5, 1.2, 2.5, 4, 6, 8}), -1);
}

TEST(Onset, ATipThatGoesOnIntoTheTissueTouchesWhenItIsSurelyInside) {
  EXPECT_EQ(onset_of({6, 4, 2, 0, -2.5, -4, -6}), 5);
}

TEST(Onset, OneBadTriangulationIsNoTouch) {
  EXPECT_EQ(onset_of({8, 6, 4, 3, -2.5, 3, 4, 6}), -1);
}

TEST(Onset, ATipThatIsLostOnItsLastWayTouchesWhereItIsSeenAtRestAgain) {
  for (const int lost_frames : {2, 20}) {
    OnsetDetector onset(kThreshold_mm);
    for (double gap : {9.0, 6.0, 3.0}) EXPECT_FALSE(onset.update(gap, kDeviation_mm, {5, 5, 90 - gap}));
    for (int i = 0; i < lost_frames; ++i) onset.lose();
    bool touched = false;
    for (double gap : {0.1, 0.05, 0.1}) touched |= onset.update(gap, kDeviation_mm, {5, 5, 90 - gap});
    EXPECT_EQ(touched, lost_frames == 2) << "what was before a long loss says nothing";
  }
}

TEST(Onset, ATipThatBeganTooEarlyMayBeginAgainOnlyAtTheSurface) {
  OnsetDetector onset(kThreshold_mm);
  EXPECT_TRUE(onset.may_begin_again(0.5));
  EXPECT_FALSE(onset.may_begin_again(2.5));
}

TEST(Onset, AfterLettingGoTheTipHasToLeaveFirst) {
  OnsetDetector onset(kThreshold_mm);
  onset.let_go({5, 5, 90});
  for (double gap : {0.0, 0.4, 0.8, 0.8, 0.8}) EXPECT_FALSE(onset.update(gap, kDeviation_mm, {5, 5, 90 - gap}));
  bool touched = false;
  for (double gap : {2.0, 4.0, 2.0, 0.5, 0.0, 0.0}) touched |= onset.update(gap, kDeviation_mm, {5, 5, 90 - gap});
  EXPECT_TRUE(touched);
}

}  // namespace
}  // namespace palpate
