#include "palpate/infer/belief.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Belief, AMotionOfTheSceneIsUndone) {
  const SceneMotion scene{{1, -2, 3}, {0.1, -0.2, 0.05}, {5, 5, 100}, {0.02, -0.03, 0.01}};
  const Vec3 point(12, -7, 95);
  EXPECT_TRUE(scene.undo(scene.apply(point)).isApprox(point, 1e-12));
  EXPECT_TRUE(scene.apply(scene.about_mm).isApprox(scene.about_mm + scene.translation_mm, 1e-12));
}

TEST(Belief, TheSceneIsNeverKnownWorseThanItsPrior) {
  const InferenceParameters parameters;
  Belief belief = initial_belief(parameters);
  for (int frame = 0; frame < 1000; ++frame) belief = predict(belief, 0.04, parameters);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LE(belief.covariance(i, i), 1.01 * parameters.scene_mm * parameters.scene_mm);
    EXPECT_GT(belief.covariance(i, i), 0.5 * parameters.scene_mm * parameters.scene_mm);
  }
}

TEST(Belief, AContactThatEndsLeavesTheRestAsItWas) {
  const InferenceParameters parameters;
  const Belief before = initial_belief(parameters);
  ContactPrior prior;
  prior.log_radius = 1;
  const Belief with = with_contact(with_contact(before, prior), {});
  EXPECT_EQ(with.contacts(), 2u);
  EXPECT_EQ(with.log_radius(0), 1);
  const Belief second = without_contact(with, 0);
  EXPECT_EQ(second.log_radius(0), 0);
  const Belief none = without_contact(second, 0);
  EXPECT_TRUE(none.mean.isApprox(before.mean));
  EXPECT_TRUE(none.covariance.isApprox(before.covariance));
}

}  // namespace
}  // namespace palpate
