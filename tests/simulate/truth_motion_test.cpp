#include "palpate/simulate/truth_motion.h"

#include <gtest/gtest.h>

#include "palpate/simulate/gesture.h"
#include "palpate/simulate/organ_shape.h"
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
  const SimulatedBreathing breathing{{1, 5, -2}, 3.2};
  EXPECT_EQ(breath_mm(breathing, 0).norm(), 0);
  EXPECT_NEAR((breath_mm(breathing, 1.6) - breathing.motion_mm).norm(), 0, 1e-12);
  EXPECT_NEAR((breath_mm(breathing, 0.8) - breathing.motion_mm / 2).norm(), 0, 1e-12);
  EXPECT_NEAR(breath_mm(breathing, 6.4).norm(), 0, 1e-12);
}

TEST(Breathing, MovesTheTipAndLeavesTheForceAsItIs) {
  SmallCase small;
  const auto still = small.solve(5, 10);
  small.demo.simulate.breathing = {{0, 4, 3}, 1.7};
  const auto breathing = small.solve(5, 10);
  ASSERT_EQ(still.size(), breathing.size());
  double peak_N = 0;
  for (size_t i = 0; i < still.size(); ++i) {
    const TruthRow &a = still[i].truth, &b = breathing[i].truth;
    EXPECT_NEAR((b.tip_mm - breath_mm(small.demo.simulate.breathing, b.time_s) - a.tip_mm).norm(), 0, 1e-12);
    EXPECT_EQ(a.force_N, b.force_N);
    EXPECT_EQ(a.in_contact, b.in_contact);
    EXPECT_EQ(breathing[i].breath_mm, breath_mm(small.demo.simulate.breathing, b.time_s));
    // The shaft still passes through its point of entry.
    const Vec3 along = (b.tip_mm - small.demo.simulate.instrument.enters_from).normalized();
    EXPECT_NEAR(along.dot(breathing[i].place.axis), 1, 1e-12);
    peak_N = std::max(peak_N, a.force_N.norm());
  }
  EXPECT_GT(peak_N, 3);
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
