#include "palpate/contact/equilibrium.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "palpate/contact/gap.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

/// A block clamped at z = 20 whose top face z = 0 looks at the camera.
struct Block {
  TetMesh mesh = test::box_mesh({40, 40, 20}, {8, 8, 4});
  std::vector<Triangle> boundary = boundary_triangles(mesh);
  TetModel model_of(Law law, double E_kPa) const {
    return TetModel(mesh, {law, E_kPa, 0.35, ""}, test::nodes_at(mesh, 2, 20));
  }
};

TEST(Footprint, TheTiedMeansAreIndependentAlsoOnAMeshCoarserThanThePatch) {
  const Block block;
  const TetModel model = block.model_of(Law::saint_venant_kirchhoff, 27);
  for (double radius : {0.5, 2.0, 5.0, 12.0}) {
    const Footprint footprint = make_footprint(model, block.boundary, {18, 21, -1}, radius);
    ASSERT_GE(footprint.means.rows(), 1);
    EXPECT_LT((footprint.means.rowwise().sum() - Eigen::VectorXd::Ones(footprint.means.rows())).norm(), 1e-12);
    const Eigen::MatrixXd J = constraint_matrix(model, footprint);
    const auto eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(J * J.transpose()).eigenvalues();
    EXPECT_GT(eigenvalues.minCoeff(), 1e-3 * eigenvalues.maxCoeff()) << "radius " << radius;
  }
}

TEST(Footprint, AMovedPatchMovesItsMeansAsMuch) {
  const Block block;
  const TetModel model = block.model_of(Law::saint_venant_kirchhoff, 27);
  const Footprint footprint = make_footprint(model, block.boundary, {18, 21, -1}, 3);
  const Vec3 p(1, -2, 0.5);
  const Eigen::VectorXd moved = constraint_matrix(model, footprint) * p.replicate(model.unknown_count() / 3, 1);
  EXPECT_LT((moved - p.replicate(moved.size() / 3, 1)).norm(), 1e-12);
}

TEST(Footprint, StandsOnTheSurfaceWithItsOutwardNormal) {
  const Block block;
  const TetModel model = block.model_of(Law::saint_venant_kirchhoff, 27);
  const Footprint footprint = make_footprint(model, block.boundary, {18, 21, -1}, 3);
  EXPECT_NEAR((footprint.center_mm - Vec3(18, 21, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((footprint.normal - Vec3(0, 0, -1)).norm(), 0, 1e-12);
}

TEST(Equilibrium, FollowsTheFootprintAndBalancesTheAttachments) {
  const Block block;
  for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean})
    for (const Vec3& p : {Vec3(0, 0, -4), Vec3(1, 2, 1.5), Vec3(3, 0, 0)}) {
      const TetModel model = block.model_of(law, 27);
      const Footprint footprint = make_footprint(model, block.boundary, {20, 20, 0}, 4);
      EquilibriumSolver solver(model);
      solver.hold(footprint);
      const Equilibrium found = solver.solve(p);
      ASSERT_TRUE(found.converged);
      const Eigen::VectorXd moved = constraint_matrix(model, footprint) * model.reduce(found.u);
      EXPECT_LT((moved - p.replicate(moved.size() / 3, 1)).lpNorm<Eigen::Infinity>(), 1e-8);
      Vec3 reaction = Vec3::Zero();
      const Eigen::VectorXd internal = model.internal_force(found.u);
      for (int node : test::nodes_at(block.mesh, 2, 20)) reaction += internal.segment<3>(3 * node);
      EXPECT_LT((found.force_N + reaction).norm(), 1e-5 * found.force_N.norm());
      EXPECT_GT(found.force_N.dot(p), 0);
    }
}

TEST(Equilibrium, TheForceIsProportionalToYoungsModulusAndTheDisplacementIndependentOfIt) {
  const Block block;
  const auto solve = [&block](double E_kPa) {
    const TetModel model = block.model_of(Law::saint_venant_kirchhoff, E_kPa);
    EquilibriumSolver solver(model);
    solver.hold(make_footprint(model, block.boundary, {20, 20, 0}, 4));
    return solver.solve({0.5, 0, -3});
  };
  const Equilibrium soft = solve(1), stiff = solve(1e5);
  ASSERT_TRUE(soft.converged && stiff.converged);
  EXPECT_NEAR(stiff.force_N.norm() / soft.force_N.norm(), 1e5, 1);
  EXPECT_LT((stiff.u - soft.u).norm(), 1e-5 * soft.u.norm());
}

TEST(Equilibrium, DoesTheWorkThatTheBodyStores) {
  const Block block;
  const TetModel model = block.model_of(Law::saint_venant_kirchhoff, 27);
  EquilibriumSolver solver(model);
  solver.hold(make_footprint(model, block.boundary, {20, 20, 0}, 4));
  double work = 0;
  Vec3 last_force = Vec3::Zero(), last_p = Vec3::Zero();
  Equilibrium found;
  for (int i = 1; i <= 40; ++i) {
    const Vec3 p = Vec3(0.5, 0.2, -3) * i / 40;
    found = solver.solve(p);
    ASSERT_TRUE(found.converged);
    work += 0.5 * (found.force_N + last_force).dot(p - last_p);
    last_force = found.force_N;
    last_p = p;
  }
  EXPECT_NEAR(work, model.energy(found.u), 2e-3 * work);
}

TEST(Equilibrium, DoesNotDependOnTheWayThere) {
  const Block block;
  const TetModel model = block.model_of(Law::neo_hookean, 27);
  const Footprint footprint = make_footprint(model, block.boundary, {20, 20, 0}, 4);
  EquilibriumSolver direct(model), detour(model);
  direct.hold(footprint);
  detour.hold(footprint);
  detour.solve({3, 0, -3});
  detour.solve({0, -2, 1});
  const Equilibrium a = direct.solve({1, 1, -2}), b = detour.solve({1, 1, -2});
  ASSERT_TRUE(a.converged && b.converged);
  EXPECT_LT((a.force_N - b.force_N).norm(), 1e-5 * a.force_N.norm());
}

TEST(Equilibrium, ATipThatComesBackFindsTheTissueAtRest) {
  const Block block;
  for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean, Law::corotated, Law::linear}) {
    const TetModel model = block.model_of(law, 400);
    EquilibriumOptions exact;
    exact.relative_residual = 1e-8;
    EquilibriumSolver solver(model, exact);
    solver.hold(make_footprint(model, block.boundary, {20, 20, 0}, 4));
    for (const Vec3& p : {Vec3(0, 0, -4), Vec3(1, 2, -2), Vec3(0.3, 0.5, -0.5)})
      ASSERT_TRUE(solver.solve(p).converged) << law_name(law);
    const Equilibrium found = solver.solve(Vec3::Zero());
    EXPECT_TRUE(found.converged) << law_name(law);
    EXPECT_LT(found.u.lpNorm<Eigen::Infinity>(), 1e-8) << law_name(law);
    EXPECT_LT(found.force_N.norm(), 1e-8) << law_name(law);
  }
}

TEST(Equilibrium, StaysConvergedThroughADeepPushWithADrag) {
  const Block block;
  for (Element element : {Element::linear, Element::averaged}) {
    const TetModel model(block.mesh, {Law::neo_hookean, 27, 0.45, ""}, test::nodes_at(block.mesh, 2, 20), element);
    EquilibriumSolver solver(model);
    solver.hold(make_footprint(model, block.boundary, {20, 20, 0}, 4));
    for (int i = 1; i <= 30; ++i) {
      const Vec3 p = i <= 15 ? Vec3(0, 0, 0.4 * i) : Vec3(0.3 * (i - 15), 0, 6);
      const Equilibrium found = solver.solve(p);
      ASSERT_TRUE(found.converged) << "at " << p.transpose();
      EXPECT_GT(found.smallest_volume_ratio, 0);
    }
  }
}

TEST(Equilibrium, GoesOnWhereItRanOutOfSolves) {
  const Block block;
  const TetModel model = block.model_of(Law::neo_hookean, 27);
  const Footprint footprint = make_footprint(model, block.boundary, {20, 20, 0}, 4);
  EquilibriumSolver hurried(model, {.max_solves = 44}), patient(model);
  hurried.hold(footprint);
  patient.hold(footprint);
  const Vec3 p(1.2, 0, 1.5);
  Equilibrium found = hurried.solve(p);
  EXPECT_FALSE(found.converged);
  EXPECT_TRUE(found.u.allFinite());
  for (int i = 0; i < 20 && !found.converged; ++i) found = hurried.solve(p);
  ASSERT_TRUE(found.converged);
  const Equilibrium direct = patient.solve(p);
  EXPECT_LT((found.force_N - direct.force_N).norm(), 1e-5 * direct.force_N.norm());
}

TEST(Equilibrium, SaysSoWhereNoStateIsFound) {
  const Block block;
  const TetModel model = block.model_of(Law::saint_venant_kirchhoff, 27);
  EquilibriumSolver solver(model);
  solver.hold(make_footprint(model, block.boundary, {20, 20, 0}, 4));
  const Equilibrium found = solver.solve({0, 0, 30});
  EXPECT_TRUE(found.u.allFinite());
  EXPECT_TRUE(found.force_N.allFinite());
  EXPECT_TRUE(!found.converged || found.smallest_volume_ratio < 0.5);
}

TEST(Detect, TheGapIsPositiveOutsideAndNegativeInside) {
  const Block block;
  const Gap outside = gap_to_surface({20, 20, -1.5}, block.mesh.nodes_mm, block.boundary);
  EXPECT_NEAR(outside.distance_mm, 1.5, 1e-12);
  EXPECT_NEAR((outside.normal - Vec3(0, 0, -1)).norm(), 0, 1e-12);
  EXPECT_NEAR(gap_to_surface({20, 20, 0.7}, block.mesh.nodes_mm, block.boundary).distance_mm, -0.7, 1e-12);
}

/// Two patches of the block's top face, 16 mm apart.
struct TwoContacts {
  Block block;
  TetModel model = block.model_of(Law::neo_hookean, 27);
  Footprint left = make_footprint(model, block.boundary, {12, 20, 0}, 3);
  Footprint right = make_footprint(model, block.boundary, {28, 20, 0}, 3);
};

TEST(TwoContacts, EachFollowsItsOwnDisplacementAndTogetherTheyBalanceTheAttachments) {
  const TwoContacts two;
  EquilibriumSolver solver(two.model);
  solver.hold(two.left);
  solver.hold_also(two.right);
  const Vec3 p(0, 0, -3), q(1, -1, 1.5);
  const Equilibrium found = solver.solve_all({p, q});
  ASSERT_TRUE(found.converged);
  const Eigen::VectorXd u = two.model.reduce(found.u);
  const Eigen::VectorXd left = constraint_matrix(two.model, two.left) * u;
  const Eigen::VectorXd right = constraint_matrix(two.model, two.right) * u;
  EXPECT_LT((left - p.replicate(left.size() / 3, 1)).lpNorm<Eigen::Infinity>(), 1e-8);
  EXPECT_LT((right - q.replicate(right.size() / 3, 1)).lpNorm<Eigen::Infinity>(), 1e-8);
  Vec3 reaction = Vec3::Zero();
  const Eigen::VectorXd internal = two.model.internal_force(found.u);
  for (int node : test::nodes_at(two.block.mesh, 2, 20)) reaction += internal.segment<3>(3 * node);
  ASSERT_EQ(found.contacts.size(), 2u);
  const Vec3 together = found.contacts[0].force_N + found.contacts[1].force_N;
  EXPECT_LT((together + reaction).norm(), 1e-5 * found.contacts[0].force_N.norm());
  EXPECT_EQ(found.force_N, found.contacts[0].force_N);
}

TEST(TwoContacts, TheForceOfEachOnTheOtherIsReciprocal) {
  const TwoContacts two;
  constexpr double kSmall_mm = 1e-3;
  Mat3 left_by_right, right_by_left;
  for (int i = 0; i < 3; ++i) {
    EquilibriumSolver solver(two.model, {.relative_residual = 1e-10});
    solver.hold(two.left);
    solver.hold_also(two.right);
    right_by_left.col(i) = solver.solve_all({kSmall_mm * Vec3::Unit(i), Vec3::Zero()}).contacts[1].force_N;
    left_by_right.col(i) = solver.solve_all({Vec3::Zero(), kSmall_mm * Vec3::Unit(i)}).contacts[0].force_N;
  }
  EXPECT_GT(left_by_right.norm(), 0);
  EXPECT_LT((left_by_right - right_by_left.transpose()).norm(), 1e-2 * left_by_right.norm());
}

TEST(TwoContacts, OneThatBeginsOnDisplacedTissueBeginsWithoutForceAndLeavesNoTraceWhenItLetsGo) {
  const TwoContacts two;
  EquilibriumSolver alone(two.model, {.relative_residual = 1e-9}), joined(two.model, {.relative_residual = 1e-9});
  const Vec3 p(0.5, 0, -3), q(0, 1, -2);
  alone.hold(two.left);
  joined.hold(two.left);
  const Equilibrium before = alone.solve(p);
  joined.solve(p);
  joined.hold_also(two.right);
  const Equilibrium begun = joined.solve_all({p, Vec3::Zero()});
  ASSERT_TRUE(begun.converged);
  EXPECT_LT(begun.contacts[1].force_N.norm(), 1e-6 * before.force_N.norm());
  EXPECT_LT((begun.force_N - before.force_N).norm(), 1e-6 * before.force_N.norm());
  const Equilibrium held = joined.solve_all({p, q});
  ASSERT_TRUE(held.converged);
  EXPECT_GT(held.contacts[1].force_N.dot(q), 0);
  joined.release(1);
  const Equilibrium after = joined.solve(p);
  ASSERT_TRUE(after.converged);
  EXPECT_LT((after.u - before.u).lpNorm<Eigen::Infinity>(), 1e-6);
  EXPECT_LT((after.force_N - before.force_N).norm(), 1e-6 * before.force_N.norm());
}

TEST(TwoContacts, TheSecondStaysWhereItIsWhenTheFirstLetsGo) {
  const TwoContacts two;
  EquilibriumSolver solver(two.model, {.relative_residual = 1e-9});
  solver.hold(two.left);
  solver.hold_also(two.right);
  const Vec3 p(0, 0, -3), q(1, -1, -1);
  solver.solve_all({p, q});
  solver.release(0);
  const Equilibrium left_over = solver.solve(q);
  EquilibriumSolver alone(two.model, {.relative_residual = 1e-9});
  alone.hold(two.right);
  const Equilibrium expected = alone.solve(q);
  ASSERT_TRUE(left_over.converged && expected.converged);
  EXPECT_LT((left_over.force_N - expected.force_N).norm(), 1e-6 * expected.force_N.norm());
}

}  // namespace
}  // namespace palpate
