#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <map>

#include "palpate/simulate/instrument_shape.h"
#include "palpate/simulate/organ_shape.h"

namespace palpate {
namespace {

// Six times the volume that the surface encloses; positive when it is oriented outwards.
double enclosed_volume_mm3(const Surface& surface) {
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles)
    sum += surface.vertices_mm[static_cast<size_t>(a)].dot(
        surface.vertices_mm[static_cast<size_t>(b)].cross(surface.vertices_mm[static_cast<size_t>(c)]));
  return sum / 6;
}

// Every edge is used once in each direction.
bool is_closed(const Surface& surface) {
  std::map<std::pair<int, int>, int> uses;
  for (const Triangle& t : surface.triangles)
    for (size_t k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : uses)
    if (count != 1 || uses.count({edge.second, edge.first}) == 0) return false;
  return true;
}

class OrganShape : public ::testing::TestWithParam<const char*> {};

TEST_P(OrganShape, IsClosedOutwardAndOfTheStatedSize) {
  SimulatedBody body;
  body.shape = GetParam();
  body.size_mm = {60, 40, 30};
  body.center_mm = {3, -2, 100};
  const Surface organ = make_organ(body, 5000);
  EXPECT_GE(organ.triangles.size(), 5000u);
  EXPECT_TRUE(is_closed(organ));
  EXPECT_GT(enclosed_volume_mm3(organ), 0.35 * 60 * 40 * 30);
  EXPECT_LT(enclosed_volume_mm3(organ), 60 * 40 * 30);
  Vec3 min = organ.vertices_mm[0], max = min;
  for (const Vec3& vertex : organ.vertices_mm) {
    min = min.cwiseMin(vertex);
    max = max.cwiseMax(vertex);
  }
  EXPECT_NEAR((max - min - body.size_mm).norm(), 0, 1e-9);
  EXPECT_NEAR(((max + min) / 2 - body.center_mm).norm(), 0, 1e-9);
}

TEST_P(OrganShape, KeepsItsVolumeWhenTurned) {
  SimulatedBody body;
  body.shape = GetParam();
  const double straight = enclosed_volume_mm3(make_organ(body, 1000));
  body.rotation_deg = {20, -35, 70};
  EXPECT_NEAR(enclosed_volume_mm3(make_organ(body, 1000)) / straight, 1, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(All, OrganShape, ::testing::Values("pear", "slab", "heart"));

TEST(OrganShapes, TurnAboutXThenYThenZOfTheCamera) {
  SimulatedBody body;
  body.rotation_deg = {90, 0, 90};
  // x: y -> z, z -> -y; then z: x -> y, y -> -x
  EXPECT_NEAR((left_from_body(body) * Vec3(0, 1, 0) - Vec3(0, 0, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR((left_from_body(body) * Vec3(0, 0, 1) - Vec3(1, 0, 0)).norm(), 0, 1e-12);
}

using Model = SimulatedInstrument::Model;

class InstrumentShape : public ::testing::TestWithParam<Model> {};

TEST_P(InstrumentShape, EndsAtItsTipAndKeepsItsTriangles) {
  SimulatedInstrument instrument;
  instrument.model = GetParam();
  const Vec3 tip(5, -3, 90), axis = Vec3(-1, -0.2, 0.6).normalized();
  const Surface open = make_instrument(instrument, {tip, axis, 1});
  const Surface closed = make_instrument(instrument, {tip, axis, 0});
  EXPECT_EQ(open.triangles, closed.triangles);
  for (const Surface& surface : {open, closed}) {
    double farthest = -1e9, widest = 0;
    for (const Vec3& vertex : surface.vertices_mm) {
      const Vec3 offset = vertex - tip;
      farthest = std::max(farthest, offset.dot(axis));
      if (offset.dot(axis) < -30) widest = std::max(widest, (offset - offset.dot(axis) * axis).norm());
    }
    EXPECT_NEAR(farthest, 0, 0.3);
    EXPECT_NEAR(widest, instrument.shaft_mm / 2, 1e-9);
  }
}

TEST_P(InstrumentShape, IsOrientedOutwards) {
  SimulatedInstrument instrument;
  instrument.model = GetParam();
  EXPECT_GT(enclosed_volume_mm3(make_instrument(instrument, {{0, 0, 80}, Vec3::UnitX(), 0.5})), 0);
}

INSTANTIATE_TEST_SUITE_P(All, InstrumentShape, ::testing::Values(Model::grasper, Model::probe, Model::hook));

}  // namespace
}  // namespace palpate
