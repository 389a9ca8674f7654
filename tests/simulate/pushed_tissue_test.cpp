#include "palpate/simulate/pushed_tissue.h"

#include <gtest/gtest.h>

#include "palpate/simulate/organ_shape.h"

namespace palpate {
namespace {

// A flat slab of liver that faces the camera, held from below, touched in its middle by a disc of 4 mm.
class PushedSlab : public ::testing::Test {
 protected:
  static SimulatedBody slab() {
    SimulatedBody body;
    body.shape = "slab";
    body.size_mm = {44, 40, 16};
    body.center_mm = {0, 0, 100};
    return body;
  }
  static TruthBody make_body(const TouchPoint& touch) {
    AttachmentRegion underside;
    underside.kind = AttachmentRegion::Kind::underside;
    underside.depth_mm = 3;
    AttachmentOptions attachments;
    attachments.regions = {underside};
    return make_truth_body(make_organ(slab(), 1500), 4000, attachments, [](const Vec3&) { return cv::Point2d(); },
                           {{touch.point_mm, touch.axes.col(0), 4, 3}});
  }
  static TissueOptions liver() {
    TissueOptions tissue;
    tissue.law = Law::neo_hookean;
    tissue.young_modulus_kPa = 27;
    tissue.poisson_ratio = 0.45;
    return tissue;
  }
  PushedTissue with_friction(double friction) const { return {model, body, touch, friction, precise}; }
  // n outwards, a to the right, b down
  Vec3 moved(double n, double a, double b) const { return touch.axes * Vec3(n, a, b); }
  Vec3 along_axes(const Vec3& force_N) const { return touch.axes.transpose() * force_N; }

  TouchPoint touch = find_touch_point(make_organ(slab(), 5000), SimulatedCamera{}, {479.5, 269.5});
  TruthBody body = make_body(touch);
  TetModel model{body.mesh, liver(), body.fixed_nodes, Element::averaged};
  EquilibriumOptions precise{.relative_residual = 1e-8};
};

TEST_F(PushedSlab, SticksWithinTheConeAndSlidesOnItsEdge) {
  const double friction = 0.4;
  PushedTissue tissue = with_friction(friction);
  bool stuck = false, slid = false;
  for (double a = 0; a < 3.1; a += 0.6) {
    const auto answer = tissue.move(moved(-1.5, a, 0));
    ASSERT_TRUE(answer.touching && answer.equilibrium.converged);
    EXPECT_LE(answer.equilibrium.residual, 1e-8);
    const Vec3 force_N = along_axes(answer.equilibrium.force_N);
    EXPECT_LT(force_N[0], 0);  // pushes
    const double fraction = force_N.tail<2>().norm() / (-friction * force_N[0]);
    EXPECT_LT(fraction, 1.02);  // the slab's surface is flat only as its triangles are
    if (answer.slid) {
      EXPECT_NEAR(fraction, 1, 0.02) << "at " << a;
    }
    stuck = stuck || (a > 0 && !answer.slid);
    slid = slid || answer.slid;
    if (a > 0.4) {
      EXPECT_GT(force_N[1], 0);  // drags along
    }
  }
  EXPECT_TRUE(stuck && slid);
}

TEST_F(PushedSlab, WithoutFrictionHasNormalForceOnlyAndTheSameOneEverywhereOnTheFlat) {
  PushedTissue tissue = with_friction(0);
  double first_N = 0;
  for (const double a : {0.0, 1.2, 2.9}) {
    const auto answer = tissue.move(moved(-1.5, a, -0.5 * a));
    ASSERT_TRUE(answer.touching);
    const Vec3 force_N = along_axes(answer.equilibrium.force_N);
    EXPECT_LT(force_N.tail<2>().norm(), 0.02 * -force_N[0]);
    if (a == 0) first_N = force_N[0];
    EXPECT_NEAR(force_N[0] / first_N, 1, 0.1) << "at " << a;  // edges under the disc are 0.4 of its radius here
  }
}

TEST_F(PushedSlab, TouchesOnlyBelowTheSurface) {
  PushedTissue tissue = with_friction(0.3);
  EXPECT_FALSE(tissue.move(moved(0.2, 0, 0)).touching);
  EXPECT_TRUE(tissue.move(moved(-0.5, 0, 0)).touching);
  EXPECT_FALSE(tissue.move(moved(0.1, 1, 0)).touching);
  // A new touch elsewhere begins stuck and unloaded along the surface.
  const auto again = tissue.move(moved(-0.5, 3, 0));
  ASSERT_TRUE(again.touching);
  const Vec3 force_N = along_axes(again.equilibrium.force_N);
  EXPECT_FALSE(again.slid);
  EXPECT_LT(force_N.tail<2>().norm(), 0.1 * -force_N[0]);
}

TEST_F(PushedSlab, ThatCannotSlideHasTheForceOfTissueThatIsHeld) {
  PushedTissue tissue = with_friction(1e6);
  EquilibriumSolver held(model, precise);
  held.hold(make_footprint(model, body.boundary, touch.point_mm, body.patches[0].radius_mm));
  for (const Vec3& move : {moved(-1, 0, 0), moved(-1.5, 1, 0.5)}) {
    const Vec3 pushed_N = tissue.move(move).equilibrium.force_N, held_N = held.solve(move).force_N;
    EXPECT_LT((pushed_N - held_N).norm(), 0.05 * held_N.norm());  // two ways to tie a disc on this mesh
  }
}

TEST_F(PushedSlab, TouchesNothingBesideTheBody) {
  PushedTissue tissue = with_friction(0);
  EXPECT_TRUE(tissue.move(moved(-1, 0, 0)).touching);
  EXPECT_FALSE(tissue.move(moved(-1, 60, 0)).touching);
}

}  // namespace
}  // namespace palpate
