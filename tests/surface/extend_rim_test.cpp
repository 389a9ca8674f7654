#include "palpate/surface/extend_rim.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "palpate/surface/cocone.h"

namespace palpate {
namespace {

constexpr double kRadius_mm = 40, kRim_mm = 25;

/// Above (x, y), the near side of a sphere of 40 mm around (0, 0, 120).
Vec3 on_cap(double x, double y) {
  return {x, y, 120 - std::sqrt(kRadius_mm * kRadius_mm - x * x - y * y)};
}

std::vector<Vec3> cap(double spacing_mm, double rim_mm, double noise_mm) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<Vec3> points;
  for (double y = -rim_mm; y <= rim_mm; y += spacing_mm)
    for (double x = -rim_mm; x <= rim_mm; x += spacing_mm)
      if (std::hypot(x, y) <= rim_mm)
        points.push_back(on_cap(x, y) + (noise_mm > 0 ? noise(random) : 0) * Vec3::UnitZ());
  return points;
}

double shadow_mm2(const Surface& surface) {
  double area = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3& p = surface.vertices_mm[static_cast<size_t>(a)];
    area += 0.5 * std::abs((surface.vertices_mm[static_cast<size_t>(b)] - p)
                               .cross(surface.vertices_mm[static_cast<size_t>(c)] - p)
                               .z());
  }
  return area;
}

TEST(ExtendRim, BringsTheRimOfAThinnedSurfaceToWhereThePointsEnd) {
  const double full_mm2 = std::numbers::pi * kRim_mm * kRim_mm;
  const Surface thinned = cocone(cap(3, kRim_mm - 1.5, 0), {});
  ASSERT_LT(shadow_mm2(thinned), 0.85 * full_mm2);
  for (double noise_mm : {0.0, 0.1}) {
    const Surface extended = extend_rim(thinned, cap(0.3, kRim_mm, noise_mm), 3);
    EXPECT_GT(shadow_mm2(extended), 0.91 * full_mm2);
    EXPECT_LT(shadow_mm2(extended), 1.01 * full_mm2);
    for (const Vec3& vertex : extended.vertices_mm)
      EXPECT_NEAR((vertex - Vec3(0, 0, 120)).norm(), kRadius_mm, 0.25) << vertex.transpose();
  }
}

TEST(ExtendRim, LeavesASurfaceAloneThatEndsWhereThePointsEnd) {
  const Surface surface = cocone(cap(3, kRim_mm, 0), {});
  const Surface same = extend_rim(surface, surface.vertices_mm, 3);
  EXPECT_EQ(same.vertices_mm, surface.vertices_mm);
  EXPECT_EQ(same.triangles, surface.triangles);
}

TEST(ExtendRim, OutliersBeyondTheEndDoNotDrawItOut) {
  const Surface thinned = cocone(cap(3, kRim_mm - 1.5, 0), {});
  std::vector<Vec3> points = cap(0.3, kRim_mm, 0);
  const size_t measured = points.size();
  for (size_t i = 0; i < measured; i += 60) points.push_back(points[i] * 1.02 + Vec3(0, 0, 1));
  for (const Vec3& vertex : extend_rim(thinned, points, 3).vertices_mm)
    EXPECT_LT(std::hypot(vertex.x(), vertex.y()), kRim_mm + 0.3);
}

}  // namespace
}  // namespace palpate
