#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "tests/support/calculix.h"
#include "tests/support/prescribed.h"
#include "tests/support/published_liver.h"
#include "tests/support/reference_data.h"

/// Forces that others have published with the positions of every node (Mestdagh and Cotin, MICCAI 2022).
namespace palpate {
namespace {

using test::PublishedLiver;

TEST(PublishedForces, TheLinearLawReturnsThoseOfTheLinearLiver) {
  PALPATE_NEEDS_REFERENCE("mestdagh_liver");
  const PublishedLiver liver = test::read_published_liver("linear_s1");
  ASSERT_EQ(liver.frames.size(), 6u);
  for (const PublishedLiver::Frame& frame : liver.frames) {
    const auto held = test::held_nodes(liver, frame);
    const TetModel model(liver.mesh, {Law::linear, 20, 0.45, ""}, test::nodes_of(held));
    const test::PrescribedEquilibrium found = test::solve_prescribed(model, held);
    ASSERT_TRUE(found.converged);
    const Vec3 force = test::net_force(liver, found.force);
    EXPECT_LT((force - frame.force_N).norm(), 1e-4 * frame.force_N.norm()) << "frame " << frame.number;
  }
}

TEST(PublishedForces, ThatLiverMovedByFiveCentimetresAgreesWithCalculixInTheOtherLaws) {
  PALPATE_NEEDS_REFERENCE("mestdagh_liver");
  PALPATE_NEEDS_CALCULIX();
  const PublishedLiver liver = test::read_published_liver("linear_s1");
  const auto held = test::held_nodes(liver, liver.frames.front());
  for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean}) {
    const TetModel model(liver.mesh, {law, 20, 0.45, ""}, test::nodes_of(held));
    const test::PrescribedEquilibrium ours = test::solve_prescribed(model, held, 5);
    ASSERT_TRUE(ours.converged);
    const test::CalculixAnswer theirs = test::run_calculix(liver.mesh, model.tissue(), held);
    const Vec3 force = test::net_force(liver, theirs.reaction);
    EXPECT_LT((test::net_force(liver, ours.force) - force).norm(), 1e-5 * force.norm()) << law_name(law);
    EXPECT_LT((ours.u - theirs.u).lpNorm<Eigen::Infinity>(), 1e-5 * theirs.u.lpNorm<Eigen::Infinity>());
  }
}

/// W = mu/2 (I1 - 3) - mu ln J + lambda/2 ln^2 J, the law of the second liver.
Mat3 logarithmic_neo_hookean_stress(const Lame& lame, const Mat3& F) {
  const Mat3 G = F.inverse().transpose();
  return lame.mu * (F - G) + lame.lambda * std::log(F.determinant()) * G;
}

TEST(PublishedForces, TheStoredPositionsOfTheNeoHookeanLiverGiveItsForcesByItsOwnLaw) {
  PALPATE_NEEDS_REFERENCE("mestdagh_liver");
  const PublishedLiver liver = test::read_published_liver("neohookean_s1");
  ASSERT_EQ(liver.frames.size(), 6u);
  const TetModel model(liver.mesh, {Law::neo_hookean, 4.5, 0.49, ""}, {});
  const Lame lame = lame_of(model.tissue());
  for (const PublishedLiver::Frame& frame : liver.frames) {
    // The weak form with the test function that is one on the loaded nodes and zero on the others.
    std::vector<Vec3> loaded(static_cast<size_t>(model.node_count()), Vec3::Zero());
    Vec3 force = Vec3::Zero();
    Eigen::VectorXd one = Eigen::VectorXd::Zero(3 * model.node_count());
    for (int node : liver.loaded) one[3 * node] = 1;
    for (int e = 0; e < model.element_count(); ++e) {
      const Vec3 gradient = (model.deformation_gradient(one, e) - Mat3::Identity()).row(0);
      force += model.rest_volume_mm3(e) *
               (logarithmic_neo_hookean_stress(lame, model.deformation_gradient(frame.u, e)) * gradient);
    }
    EXPECT_LT((force - frame.force_N).norm(), 1e-6 * frame.force_N.norm()) << "frame " << frame.number;
  }
}

}  // namespace
}  // namespace palpate
