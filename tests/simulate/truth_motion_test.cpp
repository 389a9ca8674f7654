#include "palpate/simulate/truth_motion.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "palpate/contact/equilibrium.h"
#include "palpate/simulate/free_tissue.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/scene_motion.h"
#include "palpate/simulate/uterus_demo.h"

namespace palpate {
namespace {

// The uterus, coarse, with a coarse body; grasped and pulled within half a second.
struct SmallCase {
  SimulatedCase demo = uterus_demo();
  TouchPoint touch;
  TruthBody truth;

  SmallCase() {
    demo.simulate.body.elements = 900;
    demo.simulate.gesture.erase(demo.simulate.gesture.begin() + 4, demo.simulate.gesture.end() - 1);
    touch = find_touch_point(make_organ(demo.simulate.body, 5000), demo.simulate.camera, {408, 196});
    truth = make_truth_body(make_organ(demo.simulate.body, 1500), demo.simulate.body.elements, demo.attachments,
                            [&](const Vec3& p) { return project(demo.simulate.camera, p, 0); },
                            {{touch.point_mm, touch.axes.col(0), 3.5}});
  }

  std::vector<Moment> solve(double fps, int frames) {
    demo.simulate.camera.fps = fps;
    MotionQuality quality;
    const auto moments = solve_motion(demo.simulate, demo.tissue, truth, {touch}, 0.3, frames, quality, [] {});
    EXPECT_LE(quality.largest_residual, 1e-8);
    return moments;
  }
};

TEST(Breathing, BeginsAtRestAndIsFullAfterHalfAPeriod) {
  SimulateOptions options;
  options.breathing = {{1, 5, -2}, 3.2};
  const Vec3& full_mm = options.breathing.motion_mm;
  EXPECT_EQ(organ_motion_mm(options, 0).norm(), 0);
  EXPECT_NEAR((organ_motion_mm(options, 1.6) - full_mm).norm(), 0, 1e-12);
  EXPECT_NEAR((organ_motion_mm(options, 0.8) - full_mm / 2).norm(), 0, 1e-12);
  EXPECT_NEAR(organ_motion_mm(options, 6.4).norm(), 0, 1e-12);
  options.heart = {{0, 0, 1}, 0.8};
  EXPECT_NEAR((organ_motion_mm(options, 1.6) - full_mm).norm(), 0, 1e-12);
  options.breathing.motion_mm.setZero();
  EXPECT_NEAR((organ_motion_mm(options, 2.0) - Vec3(0, 0, 1)).norm(), 0, 1e-12);
}

TEST(Breathing, WhereTheInstrumentFollowsMovesTheTipAndLeavesTheForceAsItIs) {
  SmallCase small;
  const auto still = small.solve(5, 10);
  small.demo.simulate.breathing = {{0, 4, 3}, 1.7, SimulatedBreathing::Instrument::follows};
  const auto breathing = small.solve(5, 10);
  ASSERT_EQ(still.size(), breathing.size());
  double peak_N = 0;
  for (size_t i = 0; i < still.size(); ++i) {
    const TruthRow &a = still[i].truth, &b = breathing[i].truth;
    EXPECT_NEAR((b.tip_mm - organ_motion_mm(small.demo.simulate, b.time_s) - a.tip_mm).norm(), 0, 1e-12);
    EXPECT_EQ(a.force_N, b.force_N);
    EXPECT_EQ(a.in_contact, b.in_contact);
    EXPECT_EQ(breathing[i].scene_mm, organ_motion_mm(small.demo.simulate, b.time_s));
    // The shaft still passes through its point of entry.
    const Vec3 along = (b.tip_mm - small.demo.simulate.instrument.enters_from).normalized();
    EXPECT_NEAR(along.dot(breathing[i].place.axis), 1, 1e-12);
    peak_N = std::max(peak_N, a.force_N.norm());
  }
  EXPECT_GT(peak_N, 3);
}

TEST(Breathing, BeneathAHandThatStandsLoadsTheTissueByWhatItHasMovedSinceTheTouch) {
  SmallCase small;
  const auto still = small.solve(10, 14);
  SimulateOptions& options = small.demo.simulate;
  options.breathing = {{0.5, 2.0, 2.2}, 4};
  options.heart = {{0, 0, 0.4}, 0.83};
  const auto moving = small.solve(10, 14);
  const double touch_s = touch_time_s(options.gesture);
  const Vec3 met_mm = organ_motion_mm(options, touch_s);
  const TetModel model(small.truth.mesh, small.demo.tissue, small.truth.fixed_nodes, Element::averaged);
  EquilibriumSolver held(model, {.relative_residual = 1e-8});
  held.hold(small.truth.patches[0].footprint);
  int in_contact = 0;
  for (size_t i = 0; i < moving.size(); ++i) {
    const TruthRow& row = moving[i].truth;
    // The hand goes its way, but for where it aims.
    if (row.time_s >= touch_s && gesture_at(options.gesture, row.time_s).in_contact) {
      EXPECT_NEAR((row.tip_mm - met_mm - still[i].truth.tip_mm).norm(), 0, 1e-9);
      const Vec3 loaded_mm = small.touch.axes * gesture_at(options.gesture, row.time_s).move_mm + met_mm -
                             organ_motion_mm(options, row.time_s);
      const Vec3 expected_N = held.solve(loaded_mm).force_N;
      EXPECT_LT((row.force_N - expected_N).norm(), 1e-5 * expected_N.norm() + 1e-9);
      ++in_contact;
    }
    if (row.time_s < touch_s - 1e-9) {
      EXPECT_FALSE(row.in_contact);
      EXPECT_TRUE(moving[i].u.size() == 0);
    }
    EXPECT_EQ(moving[i].scene_mm, organ_motion_mm(options, row.time_s));
  }
  EXPECT_GE(in_contact, 4);
}

TEST(Breathing, BeneathAHandThatStandsBeginsTheContactWithoutForce) {
  SmallCase small;
  small.demo.simulate.breathing = {{0.5, 2.0, 2.2}, 4};
  const auto moments = small.solve(5, 8);  // a frame is at the touch, 0.6 s
  const TruthRow& touch = moments.at(3).truth;
  EXPECT_TRUE(touch.in_contact);
  EXPECT_LT(touch.force_N.norm(), 1e-6);
  const Vec3 met_mm = small.touch.point_mm + organ_motion_mm(small.demo.simulate, 0.6);
  EXPECT_LT((touch.tip_mm - met_mm).norm(), 1e-9);
}

TEST(Breathing, PressesATipThatHasLetGoAndIsStillBelowTheSurface) {
  SmallCase small;
  SimulateOptions& options = small.demo.simulate;
  options.body.elements = 5000;  // fewer cannot tell the patch from a point
  small.truth = make_truth_body(make_organ(options.body, 5000), options.body.elements, small.demo.attachments,
                                [&](const Vec3& p) { return project(options.camera, p, 0); },
                                {{small.touch.point_mm, small.touch.axes.col(0), 3.5}});
  options.gesture.resize(2);  // approach, grasp
  GestureRow hold, release;
  hold.hold_s = 0.6;
  release.release = true;
  release.leave_s = 0.6;
  options.gesture.insert(options.gesture.end(), {hold, release});
  options.breathing = {2.5 * small.touch.axes.col(0), 4};  // towards the hand
  int pressed = 0;
  const auto moments = small.solve(10, 18);
  for (const Moment& moment : moments) {
    if (moment.truth.time_s < 1.25) continue;
    if (moment.truth.in_contact) {
      EXPECT_LT(moment.truth.force_N.dot(small.touch.axes.col(0)), 0);
    }
    pressed += moment.truth.in_contact;
  }
  EXPECT_GE(pressed, 1);
  EXPECT_FALSE(moments.back().truth.in_contact);
}

TEST(CameraPan, MovesEverythingInThePictureAndLeavesTheForceAsItIs) {
  SmallCase small;
  const auto fixed = small.solve(5, 10);
  SimulatedPan& pan = small.demo.simulate.camera.pan;
  pan = {{5, 0, -1}, 0.4, 1.0};
  const auto panned = small.solve(5, 10);
  for (size_t i = 0; i < fixed.size(); ++i) {
    const double time_s = fixed[i].truth.time_s;
    const Vec3 camera_mm = camera_motion_mm(pan, time_s);
    EXPECT_NEAR(camera_mm.norm(), time_s <= 0.4 ? 0 : time_s >= 1.4 ? pan.by_mm.norm() : camera_mm.norm(), 1e-12);
    EXPECT_NEAR((panned[i].truth.tip_mm + camera_mm - fixed[i].truth.tip_mm).norm(), 0, 1e-12);
    EXPECT_EQ(panned[i].scene_mm, -camera_mm);
    EXPECT_EQ(panned[i].place.axis, fixed[i].place.axis);
    EXPECT_EQ(panned[i].truth.force_N, fixed[i].truth.force_N);
  }
}

TEST(Stretch, StrainsTheAttachmentsAndBalancesTheTissueBetweenThem) {
  SmallCase small;
  TetModel model(small.truth.mesh, small.demo.tissue, small.truth.fixed_nodes, Element::averaged);
  const Vec3 strain(0.02, -0.01, 0), middle_mm = small.demo.simulate.body.center_mm;
  const Eigen::VectorXd u = stretch_free_tissue(model, strain, middle_mm);
  const auto affine = [&](int node) -> Vec3 {
    return strain.cwiseProduct(small.truth.mesh.nodes_mm[static_cast<size_t>(node)] - middle_mm);
  };
  for (const int node : small.truth.fixed_nodes) EXPECT_LT((u.segment<3>(3 * node) - affine(node)).norm(), 1e-12);
  const Eigen::VectorXd force_N = model.internal_force(u);
  EXPECT_LT(model.reduce(force_N).lpNorm<Eigen::Infinity>(), 1e-8 * force_N.lpNorm<Eigen::Infinity>());
  double farthest_mm = 0;
  for (int node = 0; node < model.node_count(); ++node)
    farthest_mm = std::max(farthest_mm, (u.segment<3>(3 * node) - affine(node)).norm());
  EXPECT_GT(farthest_mm, 0.01);  // what is free does not follow the strain
  EXPECT_EQ(model.expand(Eigen::VectorXd::Zero(model.unknown_count())), u);
}

TEST(Stretch, OfATouchedBodyLoadsTheTipByWhatTheTissueHasMovedSinceTheTouch) {
  SmallCase small;
  SimulateOptions& options = small.demo.simulate;
  options.gesture.resize(2);
  GestureRow hold;
  hold.hold_s = 1;
  options.gesture.push_back(hold);
  options.stretch = {{0.02, 0.02, 0}, 4};
  const auto moments = small.solve(5, 9);
  EXPECT_LT(moments.at(3).truth.force_N.norm(), 1e-6);  // at the touch
  TetModel model(small.truth.mesh, small.demo.tissue, small.truth.fixed_nodes, Element::averaged);
  const auto patch_mm = [&](double time_s) {
    const Eigen::VectorXd u =
        stretch_free_tissue(model, attachment_strain(options.stretch, time_s), options.body.center_mm);
    return patch_moved_mm(small.truth.patches[0], u);
  };
  const Vec3 moved_mm = patch_mm(1.6) - patch_mm(0.6);
  const TetModel at_rest(small.truth.mesh, small.demo.tissue, small.truth.fixed_nodes, Element::averaged);
  EquilibriumSolver held(at_rest, {.relative_residual = 1e-8});
  held.hold(small.truth.patches[0].footprint);
  const Vec3 expected_N = held.solve(-moved_mm).force_N;
  EXPECT_GT(expected_N.norm(), 0.1);
  // 2 % of strain change the stiffness by some per cent.
  EXPECT_LT((moments.at(8).truth.force_N - expected_N).norm(), 0.1 * expected_N.norm());
  EXPECT_LT((moments.at(8).truth.tip_mm - small.touch.point_mm - patch_mm(0.6)).norm(), 1e-9);
}

TEST(Obscured, HidesTheTipForTheStatedTimeOnly) {
  SmallCase small;
  small.demo.simulate.obscured = {0.4, 0.8};
  for (const Moment& moment : small.solve(5, 8))
    EXPECT_EQ(moment.truth.visible, moment.truth.frame != 2 && moment.truth.frame != 3) << moment.truth.frame;
}

TEST(Interlace, SolvesEveryFieldAtItsOwnTime) {
  SmallCase small;
  const auto twice_as_fast = small.solve(10, 16);
  small.demo.simulate.look.interlace = true;
  const auto fields = small.solve(5, 8);
  ASSERT_EQ(fields.size(), 16u);
  for (size_t i = 0; i < fields.size(); ++i) {
    EXPECT_EQ(fields[i].truth.frame, static_cast<int>(i) / 2);
    EXPECT_NEAR(fields[i].truth.time_s, twice_as_fast[i].truth.time_s, 1e-12);
    EXPECT_EQ(fields[i].truth.force_N, twice_as_fast[i].truth.force_N);
    EXPECT_EQ(fields[i].truth.tip_mm, twice_as_fast[i].truth.tip_mm);
  }
}

}  // namespace
}  // namespace palpate
