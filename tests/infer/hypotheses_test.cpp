#include "palpate/infer/hypotheses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "palpate/infer/hold_filter.h"

namespace palpate {
namespace {

FreeTip tip_at(double gap_mm, const Vec3& step_mm) {
  FreeTip tip;
  tip.gap_mm = gap_mm;
  tip.gap_deviation_mm = 0.3;
  tip.step_mm = step_mm;
  tip.step_covariance_mm2 = 0.0025 * Mat3::Identity();
  return tip;
}

double log_odds(const FreeTip& tip) {
  const InferenceParameters parameters;
  return touch_evidence(tip, 0.04, parameters).log_ratio + std::log(parameters.touch_per_s * 0.04);
}

TEST(Hypotheses, ATipThatRestsAtTheSurfaceTouches) {
  EXPECT_GT(log_odds(tip_at(0.1, Vec3(0.01, 0, 0.02))), 2);
}

TEST(Hypotheses, ATipOnItsWayThroughTheArmedZoneDoesNotTouchYet) {
  EXPECT_LT(log_odds(tip_at(0.4, Vec3(0, 0, 1.2))), -1);
}

TEST(Hypotheses, ATipThatRestsAboveTheSurfaceIsFree) {
  EXPECT_LT(log_odds(tip_at(2.5, Vec3::Zero())), -1);
}

TEST(Hypotheses, ATipFoundInsideHasTouchedUnnoticed) {
  const InferenceParameters parameters;
  const TouchEvidence evidence = touch_evidence(tip_at(-3, Vec3(0, 0, 1)), 0.04, parameters);
  EXPECT_TRUE(evidence.unnoticed);
  EXPECT_GT(evidence.log_ratio, 5);
}

TEST(Hypotheses, APullLiesInNoFrictionConeAndAPressDoes) {
  const Vec3 normal(0, 0, -1);
  const Mat3 covariance = 0.01 * Mat3::Identity();
  EXPECT_EQ(log_in_friction_cone({0, 0, 2}, covariance, normal, 0.3, 0.5), 0);
  EXPECT_LT(log_in_friction_cone({0, 0, -2}, covariance, normal, 0.3, 0.5), -50);
  EXPECT_LT(log_in_friction_cone({2, 0, 1}, covariance, normal, 0.3, 0.5), -10);
  EXPECT_NEAR(log_in_friction_cone(Vec3::Zero(), covariance, normal, 0.3, 0.5), 0, 1e-9);
}

TEST(Hypotheses, WhatTheSceneRulesOutIsNeverProbable) {
  HoldFilter grasps(Grip::grasp), pushes(Grip::push);
  for (HoldFilter* filter : {&grasps, &pushes}) {
    filter->touch(0.9);
    filter->update({0, 5, 50, 50});
  }
  EXPECT_EQ(grasps.most_probable(), Hold::grasp);
  EXPECT_EQ(grasps.probability(Hold::push), 0);
  EXPECT_NE(pushes.most_probable(), Hold::grasp);
  EXPECT_EQ(pushes.probability(Hold::grasp), 0);
}

TEST(Hypotheses, AReleaseIsSeenInOneFrameAndAHoldThatComesBackInAFew) {
  const InferenceParameters parameters;
  HoldFilter filter(Grip::automatic);
  filter.touch(0.95);
  for (int frame = 0; frame < 20; ++frame) {
    filter.predict(0.04, parameters);
    filter.update({-20, 0, 0, -5});
  }
  EXPECT_GT(filter.p_contact(), 0.999);
  filter.predict(0.04, parameters);
  filter.update({15, 0, 0, -5});
  EXPECT_LT(filter.p_contact(), 0.5);
  for (int frame = 0; frame < 3; ++frame) {
    filter.predict(0.04, parameters);
    filter.update({-6, 0, 0, -5});
  }
  EXPECT_GT(filter.p_contact(), 0.5);
}

TEST(Hypotheses, GraspAndPushThatCannotBeToldApartKeepTheLastAnswer) {
  HoldFilter filter(Grip::automatic);
  filter.touch(1);
  filter.update({-50, 0, 3, -50});
  EXPECT_EQ(filter.most_probable(), Hold::push);
  filter.update({-50, 0, -3.2, -50});
  EXPECT_EQ(filter.most_probable(), Hold::push);
  filter.update({-50, 0, -3, -50});
  EXPECT_EQ(filter.most_probable(), Hold::grasp);
}

TEST(Hypotheses, ProbabilitiesStayProbabilities) {
  const InferenceParameters parameters;
  HoldFilter filter(Grip::automatic);
  filter.touch(0.7);
  for (int frame = 0; frame < 500; ++frame) {
    filter.predict(0.04, parameters);
    filter.update({std::sin(frame), std::cos(0.7 * frame), std::sin(1.3 * frame), std::cos(2.1 * frame)});
    double sum = 0;
    for (Hold hold : {Hold::free, Hold::grasp, Hold::push, Hold::slide}) sum += filter.probability(hold);
    ASSERT_NEAR(sum, 1, 1e-9);
  }
}

}  // namespace
}  // namespace palpate
