#include "palpate/volume/tetrahedralize.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/volume/body.h"
#include "palpate/volume/inside.h"
#include "tests/support/reference_data.h"
#include "tests/volume/shapes.h"

namespace palpate {
namespace {

using namespace palpate::test;

double bowl(double x, double y) {
  return 100 + (x * x + y * y) / 60;
}

struct Case {
  std::string name;
  Surface body;
  int elements;
  double volume_tolerance;
  double max_rms_mm;  ///< of the body's vertices to the boundary of the mesh
};

void PrintTo(const Case& given, std::ostream* stream) {
  *stream << given.name << " with " << given.elements << " elements";
}

void expect_good_mesh(const Surface& body, const TetMesh& mesh, const MeshReport& report, int elements) {
  EXPECT_NEAR(report.elements, elements, 0.1 * elements);
  EXPECT_EQ(report.elements, static_cast<int>(mesh.tetrahedra.size()));
  EXPECT_EQ(mesh.label.size(), mesh.tetrahedra.size());
  EXPECT_GT(smallest_volume_mm3(mesh), 0);
  EXPECT_GE(smallest_dihedral_deg(mesh), 10);
  EXPECT_NEAR(report.smallest_dihedral_deg, smallest_dihedral_deg(mesh), 1e-9);
  EXPECT_EQ(boundary_fault(mesh), "");
  EXPECT_GT(enclosed_volume_mm3(body), 0);
}

class Filled : public testing::TestWithParam<Case> {};

TEST_P(Filled, HasTheCountPositiveElementsGoodAnglesAndTheVolume) {
  const Case& given = GetParam();
  MeshReport report;
  const TetMesh mesh = tetrahedralize(given.body, given.elements, {}, &report);
  expect_good_mesh(given.body, mesh, report, given.elements);
  EXPECT_NEAR(total_volume_mm3(mesh) / enclosed_volume_mm3(given.body), 1, given.volume_tolerance);
  EXPECT_LT(rms_distance_mm(given.body.vertices_mm, mesh), given.max_rms_mm);
}

INSTANTIATE_TEST_SUITE_P(Bodies, Filled,
                         testing::Values(Case{"ellipsoid", ellipsoid({5, 3, 120}, {32, 24, 18}, 4), 550, 0.003, 0.3},
                                         Case{"ellipsoid", ellipsoid({5, 3, 120}, {32, 24, 18}, 4), 1344, 0.003, 0.15},
                                         Case{"ellipsoid", ellipsoid({5, 3, 120}, {32, 24, 18}, 4), 10000, 0.002, 0.06},
                                         Case{"box", box({-30, -25, 90}, {30, 25, 115}), 550, 0.02, 3},
                                         Case{"box", box({-30, -25, 90}, {30, 25, 115}), 1344, 0.02, 2.5},
                                         Case{"bowl", close_body(height_field(35, 40, bowl), 25), 1344, 0.02, 0.6},
                                         Case{"bowl", close_body(height_field(35, 40, bowl), 25), 10000, 0.005, 0.25}));

class FilledScan : public testing::TestWithParam<std::pair<std::string, LengthUnit>> {};

TEST_P(FilledScan, FollowsThePublishedShape) {
  const auto& [name, unit] = GetParam();
  PALPATE_NEEDS_REFERENCE(name);
  const Surface body = read_body(reference_data() / name, unit);
  MeshReport report;
  const TetMesh mesh = tetrahedralize(body, 1344, {}, &report);
  expect_good_mesh(body, mesh, report, 1344);
  EXPECT_NEAR(total_volume_mm3(mesh) / enclosed_volume_mm3(body), 1, 0.005);
  const double size_mm = std::cbrt(enclosed_volume_mm3(body));
  EXPECT_LT(rms_distance_mm(body.vertices_mm, mesh), 0.02 * size_mm);
}

INSTANTIATE_TEST_SUITE_P(Scans, FilledScan,
                         testing::Values(std::pair{"rendered_uterus/surface_rest.ply", LengthUnit::mm},
                                         std::pair{"rendered_liver/surface_rest.ply", LengthUnit::mm},
                                         std::pair{"mestdagh_liver/liver.msh", LengthUnit::m},
                                         std::pair{"sofa_meshes/liver.msh", LengthUnit::mm}));

TEST(Tetrahedralize, TheCameraSideOfA60mmOrganIsWithin03mm) {
  const Surface organ = ellipsoid({0, 0, 110}, {30, 22, 18}, 4);
  std::vector<Vec3> front;
  for (const Vec3& v : organ.vertices_mm)
    if (v.z() < 110) front.push_back(v);
  EXPECT_LT(rms_distance_mm(front, tetrahedralize(organ, 1344)), 0.3);
}

TEST(Tetrahedralize, TheSameInputGivesTheSameMesh) {
  const Surface body = ellipsoid({5, 3, 120}, {32, 24, 18}, 3);
  const TetMesh first = tetrahedralize(body, 800);
  tetrahedralize(box({0, 0, 50}, {10, 20, 80}), 500);  // whatever random numbers this one takes
  const TetMesh second = tetrahedralize(body, 800);
  EXPECT_EQ(first.tetrahedra, second.tetrahedra);
  EXPECT_EQ(first.nodes_mm, second.nodes_mm);
}

TEST(Tetrahedralize, IsFinerInTheFocus) {
  const Surface body = ellipsoid({0, 0, 120}, {32, 24, 18}, 4);
  const Vec3 focus(0, 0, 102);
  MeshReport report;
  const TetMesh mesh = tetrahedralize(body, 2000, MeshFocus{focus, 6, 0.4}, &report);
  EXPECT_NEAR(report.elements, 2000, 200);
  EXPECT_GE(report.smallest_dihedral_deg, 10);
  double near = 0, far = 0;
  int near_count = 0, far_count = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = i + 1; j < 4; ++j) {
        const Vec3 &a = mesh.nodes_mm[static_cast<size_t>(t[i])], &b = mesh.nodes_mm[static_cast<size_t>(t[j])];
        const double distance = ((a + b) / 2 - focus).norm();
        if (distance < 5) near += (a - b).norm(), ++near_count;
        if (distance > 30) far += (a - b).norm(), ++far_count;
      }
  ASSERT_GT(near_count, 0);
  EXPECT_NEAR((near / near_count) / (far / far_count), 0.4, 0.12);
}

TEST(Tetrahedralize, ASurfaceThatOverlapsItselfIsFilledOnce) {
  Surface twice = ellipsoid({-6, 0, 100}, {15, 15, 15}, 4);
  const Surface other = ellipsoid({6, 0, 100}, {15, 15, 15}, 4);
  const auto offset = static_cast<int>(twice.vertices_mm.size());
  twice.vertices_mm.insert(twice.vertices_mm.end(), other.vertices_mm.begin(), other.vertices_mm.end());
  for (const Triangle& t : other.triangles) twice.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  const double r = 15, half = 6, cap = r - half;
  const double expected = 2 * (4.0 / 3 * M_PI * r * r * r) - 2 * (M_PI * cap * cap * (3 * r - cap) / 3);
  const TetMesh mesh = tetrahedralize(twice, 3000);
  EXPECT_NEAR(total_volume_mm3(mesh) / expected, 1, 0.01);
  EXPECT_EQ(boundary_fault(mesh), "");
}

TEST(Tetrahedralize, RefusesWhatEnclosesNothing) {
  EXPECT_THROW(tetrahedralize(Surface{}, 1000), BadInput);
  Surface inwards = ellipsoid({0, 0, 100}, {10, 10, 10}, 2);
  for (Triangle& t : inwards.triangles) std::swap(t[0], t[1]);
  EXPECT_THROW(tetrahedralize(inwards, 1000), BadInput);
}

}  // namespace
}  // namespace palpate
