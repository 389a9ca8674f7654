#include "palpate/core/geometry.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/meshes.h"

namespace palpate {
namespace {

TEST(Geometry, TheBoundaryOfABoxIsClosedOutwardAndHasItsVolume) {
  const TetMesh mesh = test::box_mesh({3, 4, 5}, {2, 3, 2});
  const std::vector<Triangle> boundary = boundary_triangles(mesh);
  EXPECT_EQ(boundary.size(), 2u * 2 * (2 * 3 + 3 * 2 + 2 * 2));
  double volume = 0;
  for (const Triangle& t : boundary)
    volume += signed_volume_mm3(Vec3::Zero(), mesh.nodes_mm[static_cast<size_t>(t[0])],
                                mesh.nodes_mm[static_cast<size_t>(t[1])], mesh.nodes_mm[static_cast<size_t>(t[2])]);
  EXPECT_NEAR(volume, 60, 1e-12);
}

TEST(Geometry, NoPointOfATriangleIsNearerThanTheClosestOne) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1), fraction(0, 1);
  const auto point = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 a = point(), b = point(), c = point(), p = 2 * point();
    const ClosestPoint nearest = closest_point_on_triangle(p, a, b, c);
    EXPECT_NEAR(nearest.barycentric.sum(), 1, 1e-12);
    EXPECT_GE(nearest.barycentric.minCoeff(), -1e-12);
    for (int i = 0; i < 50; ++i) {
      double v = fraction(random), w = fraction(random);
      if (v + w > 1) v = 1 - v, w = 1 - w;
      EXPECT_GE((p - ((1 - v - w) * a + v * b + w * c)).norm(), nearest.distance - 1e-12);
    }
  }
}

}  // namespace
}  // namespace palpate
