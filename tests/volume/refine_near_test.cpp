#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "palpate/volume/tetrahedralize.h"
#include "tests/volume/shapes.h"

namespace palpate {
namespace {

using namespace palpate::test;

double distance_to_edge(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + t * (b - a) - p).norm();
}

double longest_edge_near(const TetMesh& mesh, const Vec3& center, double radius) {
  double longest = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = i + 1; j < 4; ++j) {
        const Vec3 &a = mesh.nodes_mm[static_cast<size_t>(t[i])], &b = mesh.nodes_mm[static_cast<size_t>(t[j])];
        if (distance_to_edge(center, a, b) <= radius) longest = std::max(longest, (a - b).norm());
      }
  return longest;
}

class RefineNear : public testing::TestWithParam<Vec3> {};

TEST_P(RefineNear, KeepsVolumeConformityNodesAndAnglesAndReachesTheEdge) {
  const TetMesh coarse = tetrahedralize(ellipsoid({0, 0, 100}, {30, 22, 18}, 3), 1344);
  const TetMesh fine = refine_near(coarse, GetParam(), 3, 1);
  EXPECT_NEAR(total_volume_mm3(fine) / total_volume_mm3(coarse), 1, 1e-12);
  EXPECT_GT(smallest_volume_mm3(fine), 0);
  EXPECT_EQ(boundary_fault(fine), "");
  EXPECT_LE(longest_edge_near(fine, GetParam(), 3), 1);
  EXPECT_GT(fine.tetrahedra.size(), coarse.tetrahedra.size());
  ASSERT_GE(fine.nodes_mm.size(), coarse.nodes_mm.size());
  for (size_t i = 0; i < coarse.nodes_mm.size(); ++i) ASSERT_EQ(fine.nodes_mm[i], coarse.nodes_mm[i]);
  // A hanging node would leave faces that belong to one element only inside the body.
  const Surface skin{fine.nodes_mm, boundary_triangles(fine)};
  double area = 0, coarse_area = 0;
  const auto area_of = [](const TetMesh& mesh) {
    double sum = 0;
    for (const Triangle& t : boundary_triangles(mesh)) {
      const Vec3& a = mesh.nodes_mm[static_cast<size_t>(t[0])];
      sum +=
          (mesh.nodes_mm[static_cast<size_t>(t[1])] - a).cross(mesh.nodes_mm[static_cast<size_t>(t[2])] - a).norm() / 2;
    }
    return sum;
  };
  area = area_of(fine);
  coarse_area = area_of(coarse);
  EXPECT_NEAR(area / coarse_area, 1, 1e-12);
  EXPECT_GE(smallest_dihedral_deg(fine), 0.6 * smallest_dihedral_deg(coarse));
}

INSTANTIATE_TEST_SUITE_P(Places, RefineNear,
                         testing::Values(Vec3(0, 0, 82), Vec3(30, 0, 100), Vec3(0, 0, 100), Vec3(10, 12, 85)));

TEST(RefineNear, AwayFromTheMeshNothingChanges) {
  const TetMesh coarse = block({0, 0, 50}, 10, 3);
  const TetMesh same = refine_near(coarse, {0, 0, 500}, 5, 0.1);
  EXPECT_EQ(same.tetrahedra, coarse.tetrahedra);
  EXPECT_EQ(same.nodes_mm.size(), coarse.nodes_mm.size());
}

TEST(RefineNear, LabelsAreInherited) {
  TetMesh coarse = block({0, 0, 50}, 10, 2);
  const auto is_left = [&](const TetMesh& mesh, const Tetrahedron& t) {
    double x = 0;
    for (int node : t) x += mesh.nodes_mm[static_cast<size_t>(node)].x() / 4;
    return x < 5;
  };
  for (size_t i = 0; i < coarse.tetrahedra.size(); ++i) coarse.label[i] = is_left(coarse, coarse.tetrahedra[i]) ? 7 : 3;
  const TetMesh fine = refine_near(coarse, {5, 5, 55}, 2, 0.8);
  ASSERT_EQ(fine.label.size(), fine.tetrahedra.size());
  for (size_t i = 0; i < fine.tetrahedra.size(); ++i)
    EXPECT_EQ(fine.label[i], is_left(fine, fine.tetrahedra[i]) ? 7 : 3);
}

TEST(RefineNear, TheSameInputGivesTheSameMesh) {
  const TetMesh coarse = block({0, 0, 50}, 10, 3);
  const TetMesh a = refine_near(coarse, {5, 5, 50}, 2, 0.5), b = refine_near(coarse, {5, 5, 50}, 2, 0.5);
  EXPECT_EQ(a.tetrahedra, b.tetrahedra);
  EXPECT_EQ(a.nodes_mm, b.nodes_mm);
}

TEST(SmallestDihedral, OfKnownTetrahedra) {
  const TetMesh regular{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {{0, 2, 1, 3}}, {0}};
  const double expected = std::acos(1.0 / 3) * 180 / M_PI;
  const double volume =
      signed_volume_mm3(regular.nodes_mm[0], regular.nodes_mm[2], regular.nodes_mm[1], regular.nodes_mm[3]);
  ASSERT_GT(volume, 0);
  EXPECT_NEAR(smallest_dihedral_deg(regular), expected, 1e-9);
  const TetMesh corner{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}, {0}};
  EXPECT_NEAR(smallest_dihedral_deg(corner), std::acos(1 / std::sqrt(3.0)) * 180 / M_PI, 1e-9);
}

}  // namespace
}  // namespace palpate
