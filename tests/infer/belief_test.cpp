#include "palpate/infer/belief.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cstdlib>

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

TEST(Belief, WhatIsNotLearnedIsConsideredAsInSchmidtsFilter) {
  const Eigen::Index n = Unknowns::count(1), at = Unknowns::offset(0), count = Unknowns::kContact - 3;
  std::srand(5);
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(n, n), H = Eigen::MatrixXd::Random(6, n),
                        R = 0.3 * Eigen::MatrixXd::Identity(6, 6), I = Eigen::MatrixXd::Identity(n, n);
  const Eigen::VectorXd z = Eigen::VectorXd::Random(6);
  const Belief prior{Eigen::VectorXd::Random(n), root * root.transpose()};
  Eigen::MatrixXd K = prior.covariance * H.transpose() * (H * prior.covariance * H.transpose() + R).inverse();
  Belief now{prior.mean + K * (z - H * prior.mean), (I - K * H) * prior.covariance};
  forget(prior, at, count, now);
  K.middleRows(at, count).setZero();  // Schmidt: the gain of what is only considered
  const Eigen::MatrixXd expected = (I - K * H) * prior.covariance * (I - K * H).transpose() + K * R * K.transpose();
  EXPECT_LT((now.mean - prior.mean - K * (z - H * prior.mean)).norm(), 1e-9);
  EXPECT_LT((now.covariance - expected).norm(), 1e-9 * expected.norm());
}

TEST(Belief, AnotherMarginalOfOneUnknownLeavesTheOthersGivenIt) {
  const Eigen::Index n = Unknowns::count(1), at = Unknowns::log_radius(0);
  std::srand(6);
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(n, n);
  const Belief before{Eigen::VectorXd::Random(n), root * root.transpose()};
  Belief now = before;
  with_marginal(at, 0.7, 0.04, now);
  EXPECT_NEAR(now.mean[at], 0.7, 1e-12);
  EXPECT_NEAR(now.covariance(at, at), 0.04, 1e-12);
  // The others, given that this one is 2.
  const auto given = [&](const Belief& b) {
    const Eigen::VectorXd column = b.covariance.col(at);
    return Belief{b.mean + column * (2 - b.mean[at]) / b.covariance(at, at),
                  b.covariance - column * column.transpose() / b.covariance(at, at)};
  };
  EXPECT_LT((given(now).mean - given(before).mean).norm(), 1e-9);
  EXPECT_LT((given(now).covariance - given(before).covariance).norm(), 1e-9);
}

}  // namespace
}  // namespace palpate
