#include <gtest/gtest.h>

#include "palpate/contact/equilibrium.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

TEST(ContactStiffness, IsTheDerivativeOfTheForceByTheDisplacement) {
  const TetMesh mesh = test::box_mesh({40, 40, 20}, {8, 8, 4});
  for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean, Law::corotated})
    for (Element element : {Element::linear, Element::averaged}) {
      const TetModel model(mesh, {law, 27, 0.45, ""}, test::nodes_at(mesh, 2, 20), element);
      EquilibriumSolver solver(model, {.relative_residual = 1e-9});
      solver.hold(make_footprint(model, boundary_triangles(mesh), {20, 20, 0}, 4));
      const Vec3 p(0.7, -0.3, -2.5);
      ASSERT_TRUE(solver.solve(p).converged);
      const ContactStiffness published = solver.contact_stiffness();
      EXPECT_LT((published.displacement_mm - p).norm(), 1e-12);
      const double h = 1e-3;
      for (int i = 0; i < 3; ++i) {
        const Vec3 plus = solver.solve(p + h * Vec3::Unit(i)).force_N,
                   minus = solver.solve(p - h * Vec3::Unit(i)).force_N;
        const Vec3 derivative = (plus - minus) / (2 * h);
        EXPECT_LT((published.stiffness_N_per_mm.col(i) - derivative).norm(), 1e-3 * derivative.norm())
            << law_name(law) << ' ' << i;
      }
    }
}

TEST(ContactStiffness, OfNoContactIsNothing) {
  const TetMesh mesh = test::box_mesh({10, 10, 10}, {2, 2, 2});
  const TetModel model(mesh, {Law::saint_venant_kirchhoff, 27, 0.45, ""}, test::nodes_at(mesh, 2, 10));
  EXPECT_EQ(EquilibriumSolver(model).contact_stiffness().force_at({1, 2, 3}), Vec3::Zero());
}

}  // namespace
}  // namespace palpate
