#include "palpate/contact/contact_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "palpate/volume/tetrahedralize.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

const TissueOptions kTissue{Law::saint_venant_kirchhoff, 27, 0.4, ""};
constexpr double kRadius_mm = 4;
const Vec3 kPlace_mm(20, 20, 0);

AttachedMesh slab(const std::vector<Vec3>& places_mm) {
  TetMesh mesh = test::box_mesh({40, 40, 20}, {8, 8, 4});
  for (const Vec3& place_mm : places_mm) mesh = refine_near(mesh, place_mm, 1.5 * kRadius_mm, 0.6 * kRadius_mm);
  const std::vector<int> fixed = test::nodes_at(mesh, 2, 20);
  return {std::move(mesh), fixed};
}

ContactModel held_slab() {
  ContactModel model(slab, kTissue, Element::averaged);
  model.begin(kPlace_mm, kRadius_mm);
  return model;
}

TEST(ContactModel, TheDerivativesByDisplacementAreThoseOfItsAnswers) {
  ContactModel model = held_slab();
  const Vec3 q(0.1, -0.05, -0.15);
  const ContactResponse response = model.respond(model.solve({q}), {q});
  constexpr double kStep_mm = 0.02;
  for (int axis = 0; axis < 3; ++axis) {
    const Equilibrium more = model.solve({q + kStep_mm * Vec3::Unit(axis)}),
                      less = model.solve({q - kStep_mm * Vec3::Unit(axis)});
    const Vec3 per_mm = (more.force_N - less.force_N) / (2 * kStep_mm);
    EXPECT_LT((per_mm - response.force.col(axis)).norm(), 0.08 * per_mm.norm()) << axis;
    const Eigen::VectorXd motion = (more.u - less.u) / (2 * kStep_mm);
    EXPECT_LT((motion - response.motion.col(axis)).norm(), 0.08 * motion.norm()) << axis;
  }
}

TEST(ContactModel, TheDerivativesByRadiusAreThoseOfItsAnswers) {
  ContactModel model = held_slab();
  const Vec3 q(0, 0, -0.2);
  const ContactResponse response = model.respond(model.solve({q}), {q});
  constexpr double kRatio = 1.25;
  ASSERT_TRUE(model.set_radius(0, kRadius_mm * kRatio, {q}));
  const Equilibrium larger = model.solve({q});
  ASSERT_TRUE(model.set_radius(0, kRadius_mm / kRatio, {q}));
  const Equilibrium smaller = model.solve({q});
  const Vec3 per_log = (larger.force_N - smaller.force_N) / (2 * std::log(kRatio));
  EXPECT_LT((per_log - response.force_per_log_radius.col(0)).norm(), 0.1 * per_log.norm());
  EXPECT_GT(larger.force_N.norm(), 1.2 * smaller.force_N.norm());
  const Eigen::VectorXd motion = (larger.u - smaller.u) / (2 * std::log(kRatio));
  EXPECT_LT((motion - response.motion_per_log_radius.col(0)).norm(), 0.1 * motion.norm());
}

TEST(ContactModel, APatchOfAnotherSizeAnswersAsOneThatWasAlwaysSo) {
  ContactModel model = held_slab();
  const Vec3 q(0.5, 0, -1);
  model.solve({q});
  const auto changed = model.set_radius(0, 6, {q});
  ASSERT_TRUE(changed);
  ContactModel fresh(slab, kTissue, Element::averaged);
  fresh.begin(kPlace_mm, 6);
  const Equilibrium expected = fresh.solve({q});
  EXPECT_LT((changed->force_N - expected.force_N).norm(), 2e-3 * expected.force_N.norm());
}

TEST(ContactModel, ABodyThatWasExpectedAnswersAsOneThatWasNot) {
  const Vec3 q(0.1, 0, -0.5);
  ContactModel sudden(slab, kTissue, Element::averaged), expected(slab, kTissue, Element::averaged);
  sudden.begin(kPlace_mm, kRadius_mm);
  expected.expect(kPlace_mm, kRadius_mm);
  expected.begin(kPlace_mm, kRadius_mm);
  EXPECT_LT((expected.solve({q}).force_N - sudden.solve({q}).force_N).norm(), 1e-3 * sudden.solve({q}).force_N.norm());
  // Expected nearby, the patch is laid where it has begun.
  ContactModel nearby(slab, kTissue, Element::averaged);
  nearby.expect(kPlace_mm + Vec3(0.6, -0.4, 0), kRadius_mm);
  nearby.begin(kPlace_mm, kRadius_mm);
  EXPECT_LT((nearby.footprint(0).center_mm - kPlace_mm).norm(), 1e-6);
  EXPECT_LT((nearby.solve({q}).force_N - sudden.solve({q}).force_N).norm(), 0.05 * sudden.solve({q}).force_N.norm());
  // Expected elsewhere, it is not used.
  ContactModel elsewhere(slab, kTissue, Element::averaged);
  elsewhere.expect({10, 10, 0}, kRadius_mm);
  elsewhere.begin(kPlace_mm, kRadius_mm);
  EXPECT_LT((elsewhere.solve({q}).force_N - sudden.solve({q}).force_N).norm(), 1e-3 * sudden.solve({q}).force_N.norm());
}

TEST(ContactModel, ARefreshedFactorDescribesTheStateAtHand) {
  ContactModel model = held_slab();
  const Vec3 q(0, 0, -2);
  const Equilibrium now = model.solve({q});
  for (int again = 0; again < 60; ++again) model.solve({q + 0.05 * Vec3::UnitX() * (again % 2)});
  const Equilibrium last = model.solve({q});
  model.refresh();
  const ContactResponse response = model.respond(last, {q});
  constexpr double kStep_mm = 0.02;
  const Vec3 per_mm =
      (model.solve({q + kStep_mm * Vec3::UnitZ()}).force_N - model.solve({q - kStep_mm * Vec3::UnitZ()}).force_N) /
      (2 * kStep_mm);
  EXPECT_LT((per_mm - response.force.col(2)).norm(), 0.1 * per_mm.norm());
  EXPECT_LT((now.force_N - last.force_N).norm(), 1e-3 * now.force_N.norm());
}

TEST(ContactModel, TwoPatchesShareOneEquilibrium) {
  ContactModel model = held_slab();
  model.begin({30, 20, 0}, 3);
  ASSERT_EQ(model.contact_count(), 2u);
  const Equilibrium alone = model.solve({Vec3(0, 0, -0.5), Vec3::Zero()});
  ASSERT_TRUE(alone.converged);
  EXPECT_LT(alone.contacts[0].force_N.z(), 0);
  EXPECT_GT(alone.contacts[1].force_N.z(), 0);  // held down while its neighbour is pulled up
  model.end(0);
  ASSERT_EQ(model.contact_count(), 1u);
  const Equilibrium rest = model.solve({Vec3::Zero()});
  EXPECT_LT(rest.force_N.norm(), 1e-3 * alone.contacts[0].force_N.norm());
}

}  // namespace
}  // namespace palpate
