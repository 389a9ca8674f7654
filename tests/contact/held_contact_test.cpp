#include "palpate/contact/held_contact.h"

#include <gtest/gtest.h>

#include "tests/support/calculix.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

/// A block clamped at z = 20 whose top face z = 0 a tip touches in the middle.
struct Block {
  TetMesh mesh = test::box_mesh({40, 40, 20}, {10, 10, 5});
  std::vector<int> clamped = test::nodes_at(mesh, 2, 20);
  HeldContact contact(Grip grip, double friction) const {
    ContactOptions options;
    options.grip = grip;
    options.friction = friction;
    options.footprint_radius_mm = 5;
    return HeldContact(body(options.footprint_radius_mm), {20, 20, 0}, options);
  }
  std::shared_ptr<TouchedBody> body(double radius_mm) const {
    const auto as_it_is = [*this](const std::vector<Vec3>&) -> AttachedMesh { return {mesh, clamped}; };
    const TissueOptions tissue{Law::neo_hookean, 27, 0.45, ""};
    return std::make_shared<TouchedBody>(as_it_is, tissue, Element::averaged, radius_mm);
  }
};

TEST(HeldContact, APushedTipKeepsToTheFrictionConeWhileItDrags) {
  const Block block;
  constexpr double kFriction = 0.3;
  HeldContact contact = block.contact(Grip::push, kFriction);
  double tip_mm = 0;
  int slides = 0;
  for (int frame = 0; frame <= 20; ++frame) {
    tip_mm = 0.4 * frame;
    const auto answer = contact.move({tip_mm, 0, 2});
    ASSERT_TRUE(answer.equilibrium.converged);
    ASSERT_FALSE(answer.let_go);
    const Vec3& force = answer.equilibrium.force_N;
    EXPECT_GT(force.z(), 0);
    EXPECT_LT(std::hypot(force.x(), force.y()), 1.03 * kFriction * force.z());
    slides += answer.slid;
  }
  EXPECT_GT(slides, 10);
  EXPECT_LT(slides, 20);
}

TEST(HeldContact, WithoutFrictionADragAddsNoForce) {
  HeldContact contact = Block{}.contact(Grip::push, 0);
  const Vec3 pressed_N = contact.move({0, 0, 2}).equilibrium.force_N;
  const auto dragged = contact.move({3, 0, 2});
  EXPECT_TRUE(dragged.slid);
  EXPECT_NEAR(dragged.equilibrium.force_N.z(), pressed_N.z(), 0.01 * pressed_N.z());
  EXPECT_LT(std::abs(dragged.equilibrium.force_N.x()), 0.03 * pressed_N.z());
}

TEST(HeldContact, APushedTipThatRetreatsLetsGoInsteadOfPulling) {
  HeldContact contact = Block{}.contact(Grip::push, 0.3);
  EXPECT_FALSE(contact.move({0, 0, 1}).let_go);
  EXPECT_TRUE(contact.move({0, 0, -0.5}).let_go);
}

TEST(HeldContact, AGraspTiesAllThreeDirections) {
  HeldContact contact = Block{}.contact(Grip::grasp, 0.3);
  for (const Vec3& p : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, -1), Vec3(0, 0, 1)}) {
    const auto answer = contact.move(p);
    EXPECT_FALSE(answer.let_go);
    EXPECT_FALSE(answer.slid);
    EXPECT_GT(answer.equilibrium.force_N.dot(p), 0.9 * answer.equilibrium.force_N.norm());
  }
}

TEST(HeldContact, TiedNodesGiveTheForceAndDisplacementsOfCalculix) {
  PALPATE_NEEDS_CALCULIX();
  const Block block;
  const Vec3 p(1.5, 0.5, -2.5);
  Footprint patch;
  test::Imposed imposed;
  for (int node : block.clamped) imposed[node] = Vec3::Zero();
  for (int node : test::nodes_at(block.mesh, 2, 0))
    if ((block.mesh.nodes_mm[static_cast<size_t>(node)] - Vec3(20, 20, 0)).norm() < 6) {
      patch.samples.push_back({{node, node, node}, Vec3::UnitX()});
      imposed[node] = p;
    }
  for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean}) {
    const TissueOptions tissue{law, 27, 0.35, ""};
    const TetModel model(block.mesh, tissue, block.clamped, Element::linear);
    EquilibriumSolver solver(model);
    solver.hold(patch);
    const Equilibrium found = solver.solve(p);
    ASSERT_TRUE(found.converged);
    const test::CalculixAnswer answer = test::run_calculix(block.mesh, tissue, imposed);
    Vec3 force_N = Vec3::Zero();
    for (const auto& sample : patch.samples) force_N += answer.reaction.segment<3>(3 * sample.nodes[0]);
    EXPECT_LT((found.force_N - force_N).norm(), 1e-4 * force_N.norm()) << law_name(law);
    EXPECT_LT((found.u - answer.u).norm(), 1e-4 * answer.u.norm()) << law_name(law);
  }
}

}  // namespace
}  // namespace palpate
