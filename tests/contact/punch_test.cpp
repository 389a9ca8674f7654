#include <gtest/gtest.h>

#include <cmath>

#include "palpate/contact/equilibrium.h"
#include "palpate/volume/tetrahedralize.h"
#include "tests/support/punched_dome.h"

namespace palpate {
namespace {

TEST(Punch, AveragedElementsTakeMostOfTheLockingAwayThatQuadraticOnesDoNotHave) {
  const TetMesh mesh = test::graded_dome(1344, 3);
  for (const test::PunchReference& reference : test::kPunchReferences) {
    const double averaged_error = test::punch_force_N(mesh, reference, Element::averaged) / reference.force_N - 1;
    const double plain_error = test::punch_force_N(mesh, reference, Element::linear) / reference.force_N - 1;
    const bool is_mild = reference.poisson_ratio < 0.47 && reference.displacement_mm < 0;
    EXPECT_LT(std::abs(averaged_error), is_mild ? 0.03 : 0.12);
    EXPECT_LT(std::abs(averaged_error), 0.3 * plain_error);
  }
}

TEST(Punch, TheForceDoesNotDependOnTheMesh) {
  const test::PunchReference pull{Law::neo_hookean, 0.45, 2, -1.5, 0};
  const double fine_N = test::punch_force_N(test::graded_dome(12000, 2), pull, Element::averaged);
  for (int elements : {1000, 1344, 4000})
    EXPECT_NEAR(test::punch_force_N(test::graded_dome(elements, 2), pull, Element::averaged) / fine_N, 1, 0.03)
        << elements;
  const TetMesh uniform = tetrahedralize(test::dome_surface({}, 2), 1344);
  const double radius_mm = pull.radius_mm;
  EXPECT_NEAR(
      test::punch_force_N(refine_near(uniform, Vec3::Zero(), radius_mm, radius_mm), pull, Element::averaged) / fine_N,
      1, 0.10);
}

TEST(Punch, ABarrierKeepsElementsOfThePapersLawFromBeingInverted) {
  constexpr double kRadius_mm = 4;
  const test::Dome dome;
  const TetMesh mesh = test::graded_dome(1344, kRadius_mm);
  std::vector<int> fixed;
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n)
    if (mesh.nodes_mm[n].z() > dome.depth_mm - 1.5) fixed.push_back(static_cast<int>(n));
  const TetModel model(mesh, {Law::saint_venant_kirchhoff_barrier, 27, 0.45, ""}, fixed);
  EquilibriumSolver solver(model);
  solver.hold(make_footprint(model, boundary_triangles(mesh), Vec3::Zero(), kRadius_mm));
  double before_N = 0;
  for (double depth_mm = 0.5; depth_mm <= 0.4 * dome.depth_mm; depth_mm += 0.5) {
    const Equilibrium found = solver.solve({0, 0, depth_mm});
    ASSERT_TRUE(found.converged) << depth_mm;
    EXPECT_GT(found.smallest_volume_ratio, 0) << depth_mm;
    EXPECT_GT(found.force_N.norm(), before_N) << depth_mm;
    before_N = found.force_N.norm();
  }
}

}  // namespace
}  // namespace palpate
