#include "palpate/surface/cocone.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/core/mesh_files.h"
#include "tests/surface/seen_surface.h"

namespace palpate {
namespace {

using namespace palpate::test;

struct Case {
  TrueSurface truth;
  View view;
  double spacing_mm;
  double most_rms_mm;
  int loops = 1;
};

class VisibleSurface : public testing::TestWithParam<Case> {};

TEST_P(VisibleSurface, IsManifoldOnePieceTowardsTheCameraAndNearTheTruth) {
  const Case& given = GetParam();
  const PointCloud seen = look_at(given.truth, given.view);
  const auto t0 = std::chrono::steady_clock::now();
  const PointCloud clean = clean_points(seen, given.spacing_mm, {});
  const auto t1 = std::chrono::steady_clock::now();
  const Surface surface = cocone(clean.position_mm, {});
  const auto t2 = std::chrono::steady_clock::now();
  printf("%s noise %.2f: %zu -> %zu pts %.0f ms, cocone %zu tri %.0f ms, loops %d, away %.4f rms pts %.3f surf %.3f\n",
         given.truth.name.c_str(), given.view.noise_mm, seen.size(), clean.size(),
         std::chrono::duration<double>(t1 - t0).count() * 1e3, surface.triangles.size(),
         std::chrono::duration<double>(t2 - t1).count() * 1e3, boundary_loops(surface), share_facing_away(surface),
         rms_distance_mm(given.truth, clean.position_mm), rms_distance_mm(given.truth, surface.vertices_mm));
  static int number = 0;
  write_ply("/tmp/mesh_case" + std::to_string(number++) + ".ply", surface);
  EXPECT_EQ(topology_fault(surface), "");
  EXPECT_EQ(boundary_loops(surface), given.loops);
  EXPECT_LT(share_facing_away(surface), 0.002);
  EXPECT_LT(rms_distance_mm(given.truth, surface.vertices_mm), given.most_rms_mm);
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

}  // namespace
}  // namespace palpate
