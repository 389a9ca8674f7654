#include "palpate/surface/cocone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "palpate/core/errors.h"
#include "tests/surface/seen_surface.h"

namespace palpate {
namespace {

using namespace palpate::test;

struct Case {
  TrueSurface truth;
  View view;
  double spacing_mm;
  double max_rms_mm;
  int loops = 1;
};

void PrintTo(const Case& given, std::ostream* stream) {
  *stream << given.truth.name << ", noise " << given.view.noise_mm << " mm, outliers " << given.view.outlier_share
          << ", spacing " << given.spacing_mm << " mm";
}

class VisibleSurface : public testing::TestWithParam<Case> {};

TEST_P(VisibleSurface, IsManifoldOnePieceTowardsTheCameraAndNearTheTruth) {
  const Case& given = GetParam();
  const PointCloud seen = look_at(given.truth, given.view);
  const PointCloud clean = clean_points(seen, given.spacing_mm, {});
  const Surface surface = cocone(clean.position_mm, {});
  EXPECT_EQ(topology_fault(surface), "");
  EXPECT_EQ(boundary_loops(surface), given.loops);
  EXPECT_LT(fraction_facing_away(surface), 0.002);
  EXPECT_LT(rms_distance_mm(given.truth, surface.vertices_mm), given.max_rms_mm);
  EXPECT_GT(surface.vertices_mm.size(), 0.95 * static_cast<double>(clean.size()));
}

View noisy(double noise_mm, double outlier_share = 0) {
  View view;
  view.noise_mm = noise_mm;
  view.outlier_share = outlier_share;
  return view;
}

View with_hole(double noise_mm) {
  View view = noisy(noise_mm);
  view.hole_center_mm = {3, -4, 80};
  view.hole_radius_mm = 5;
  return view;
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, VisibleSurface,
    testing::Values(Case{sphere_cap(), noisy(0), 1.5, 0.05}, Case{saddle(), noisy(0), 1.5, 0.05},
                    Case{torus_patch(), noisy(0), 1.5, 0.1, 2}, Case{bumpy_organ(), noisy(0), 1.5, 0.1},
                    Case{sphere_cap(), noisy(0.3), 1.5, 0.15}, Case{saddle(), noisy(0.5), 1.5, 0.15},
                    Case{torus_patch(), noisy(0.3), 1.5, 0.2, 2}, Case{bumpy_organ(), noisy(0.4), 1.5, 0.2},
                    Case{bumpy_organ(), noisy(0.3, 0.05), 1.5, 0.2}, Case{sphere_cap(), noisy(0.5, 0.05), 1.0, 0.2},
                    Case{sphere_cap(), noisy(0.5, 0.05), 2.5, 0.2}, Case{sphere_cap(), with_hole(0.2), 1.5, 0.2}));

double distance_to_nearest_vertex(const Vec3& p, const Surface& surface) {
  double nearest = 1e300;
  for (const Vec3& v : surface.vertices_mm) nearest = std::min(nearest, (v - p).norm());
  return nearest;
}

TEST(Cocone, ClosesAHoleSmoothlyUpToTheWantedSize) {
  View view = noisy(0.1);
  view.hole_center_mm = {3, -4, 80};
  view.hole_radius_mm = 6;
  const PointCloud clean = clean_points(look_at(sphere_cap(), view), 1.5, {});
  SurfaceOptions closing, leaving;
  closing.largest_hole_mm = 15;
  leaving.largest_hole_mm = 8;
  const Surface closed = cocone(clean.position_mm, closing), open = cocone(clean.position_mm, leaving);
  EXPECT_EQ(boundary_loops(closed), 1);
  EXPECT_EQ(boundary_loops(open), 2);
  // A flat lid over 12 mm of a sphere of 30 mm would lie 0.6 mm too deep.
  double deepest = 0;
  int inside_hole = 0;
  for (const Vec3& v : closed.vertices_mm) {
    if ((v - view.hole_center_mm).norm() > 5) continue;
    ++inside_hole;
    deepest = std::max(deepest, sphere_cap().distance_mm(v));
  }
  EXPECT_GT(inside_hole, 10);
  EXPECT_LT(deepest, 0.3);
}

TEST(Cocone, DoesNotBridgeADepthEdge) {
  for (int ramp_px : {0, 6}) {
    View view = noisy(0.2);
    view.ramp_px = ramp_px;
    const TrueSurface truth = ball_before_wall();
    const Surface surface = cocone(clean_points(look_at(truth, view), 1.5, {}).position_mm, {});
    EXPECT_EQ(topology_fault(surface), "");
    int on_ball = 0;
    for (const Vec3& v : surface.vertices_mm) on_ball += v.z() < 110;
    EXPECT_EQ(on_ball, 0) << "ball and wall hang together, ramp " << ramp_px;
    EXPECT_LT(rms_distance_mm(truth, surface.vertices_mm), 0.15) << "ramp " << ramp_px;
  }
}

TEST(Cocone, TheSamePointsGiveTheSameSurface) {
  const PointCloud clean = clean_points(look_at(bumpy_organ(), noisy(0.3)), 2, {});
  const Surface first = cocone(clean.position_mm, {}), second = cocone(clean.position_mm, {});
  EXPECT_EQ(first.triangles, second.triangles);
  EXPECT_EQ(first.vertices_mm, second.vertices_mm);
}

TEST(Cocone, OfRawNoisyPointsIsStillManifold) {
  // Without cleaning nothing is promised about the shape, but the topology holds.
  View view = noisy(0.4, 0.02);
  view.step_px = 7;
  const Surface surface = cocone(look_at(sphere_cap(), view).position_mm, {});
  EXPECT_EQ(topology_fault(surface), "");
}

TEST(Cocone, RefusesPointsWithoutASurface) {
  EXPECT_THROW(cocone({}, {}), BadInput);
  EXPECT_THROW(cocone({{0, 0, 100}, {1, 0, 100}, {0, 1, 100}}, {}), BadInput);
  std::vector<Vec3> line;
  for (int i = 0; i < 100; ++i) line.emplace_back(i, 0, 100);
  EXPECT_THROW(cocone(line, {}), BadInput);
}

TEST(CleanPoints, AreSpacedAsWanted) {
  const PointCloud clean = clean_points(look_at(sphere_cap(), noisy(0.3)), 2, {});
  for (size_t i = 0; i < clean.size(); ++i)
    for (size_t j = 0; j < i; ++j) EXPECT_GT((clean.position_mm[i] - clean.position_mm[j]).norm(), 0.7 * 2);
  // No gap: every seen point has a clean one within the spacing.
  View sparse;
  sparse.step_px = 10;
  const Surface points{clean.position_mm, {}};
  int alone = 0, seen = 0;
  for (const Vec3& p : look_at(sphere_cap(), sparse).position_mm) {
    if (-sphere_cap().normal(p).dot(p.normalized()) < 0.35) continue;
    ++seen;
    alone += distance_to_nearest_vertex(p, points) > 2.2;
  }
  EXPECT_LT(alone, 0.01 * seen);
}

TEST(CleanPoints, StateADeviationThatFitsTheirError) {
  const PointCloud clean = clean_points(look_at(sphere_cap(), noisy(0.4)), 2, {});
  double stated = 0, true_error = 0;
  for (size_t i = 0; i < clean.size(); ++i) {
    const Vec3& p = clean.position_mm[i];
    const double cosine = -sphere_cap().normal(p).dot(p.normalized());
    if (cosine < 0.6) continue;
    stated += std::pow(static_cast<double>(clean.depth_deviation_mm[i]), 2);
    true_error += std::pow(sphere_cap().distance_mm(p) / cosine, 2);
  }
  EXPECT_NEAR(std::sqrt(stated / true_error), 1, 0.4);
}

TEST(CleanPoints, SurvivePointsThatAreNoPoints) {
  PointCloud cloud = look_at(sphere_cap(), noisy(0.2));
  for (size_t i = 0; i < cloud.size(); i += 50) cloud.position_mm[i] = Vec3::Constant(std::nan(""));
  for (size_t i = 1; i < cloud.size(); i += 50) cloud.position_mm[i] = {0, 0, 0};
  for (size_t i = 2; i < cloud.size(); i += 50) cloud.depth_deviation_mm[i] = 0;
  const PointCloud clean = clean_points(cloud, 2, {});
  EXPECT_LT(rms_distance_mm(sphere_cap(), clean.position_mm), 0.1);
}

TEST(CleanPoints, TooFewAreBadInput) {
  View view;
  view.step_px = 60;
  EXPECT_THROW(clean_points(look_at(sphere_cap(), view), 2, {}), BadInput);
  EXPECT_THROW(clean_points({}, 2, {}), BadInput);
}

}  // namespace
}  // namespace palpate
