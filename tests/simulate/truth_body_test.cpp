#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "palpate/contact/equilibrium.h"
#include "palpate/core/errors.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/truth_body.h"
#include "palpate/simulate/uterus_demo.h"

namespace palpate {
namespace {

// The demo's organ, coarse, touched where its surface is nearest to the camera.
class TruthBodyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    demo = uterus_demo();
    organ = make_organ(demo.simulate.body, 1200);
    const std::vector<Vec3> normals = vertex_normals(organ.vertices_mm, organ.triangles);
    size_t nearest = 0;
    for (size_t i = 0; i < organ.vertices_mm.size(); ++i)
      if (organ.vertices_mm[i].z() < organ.vertices_mm[nearest].z()) nearest = i;
    touch = organ.vertices_mm[nearest];
    normal = normals[nearest];
    body = make(touch, normal);
  }

  TruthBody make(const Vec3& at, const Vec3& outward) const {
    return make_truth_body(organ, 1200, demo.attachments, [](const Vec3&) { return cv::Point2d(); },
                           {{at, outward, 4}});
  }

  SimulatedCase demo;
  Surface organ;
  Vec3 touch, normal;
  TruthBody body;
};

TEST_F(TruthBodyTest, TiesOnlyFreeSurfaceNodesNearTheContact) {
  ASSERT_GE(body.patches[0].footprint.samples.size(), 6u);
  for (const auto& sample : body.patches[0].footprint.samples) {
    EXPECT_LT((body.mesh.nodes_mm[static_cast<size_t>(sample.nodes[0])] - touch).norm(), 4.5);
    EXPECT_EQ(sample.barycentric, Vec3::UnitX());
  }
  EXPECT_NEAR(body.patches[0].radius_mm, 4, 0.8);
}

// Mean square distance of what is held along the long axis, across it, and from the nearest node to the middle, mm.
TEST_F(TruthBodyTest, HoldsTheShapeThatIsAskedFor) {
  using Patch = SimulatedTruth::Patch;
  const Vec3 along = normal.unitOrthogonal(), across = normal.cross(along);
  struct Extent {
    double along_mm, across_mm, nearest_mm;
  };
  const auto extent = [&](Patch shape) {
    const TruthBody held = make_truth_body(organ, 6000, demo.attachments, [](const Vec3&) { return cv::Point2d(); },
                                           {{touch, normal, 4, 0, shape, along}});
    EXPECT_NEAR(held.patches[0].radius_mm, 4, 0.8);
    EXPECT_EQ(held.patches[0].footprint.means.rows(), shape == Patch::soft_rim ? 1 : 0);
    Extent found{0, 0, 100};
    const auto& samples = held.patches[0].footprint.samples;
    for (const auto& sample : samples) {
      const Vec3 offset = held.mesh.nodes_mm[static_cast<size_t>(sample.nodes[0])] - touch;
      found.along_mm += std::pow(offset.dot(along), 2) / static_cast<double>(samples.size());
      found.across_mm += std::pow(offset.dot(across), 2) / static_cast<double>(samples.size());
      found.nearest_mm = std::min(found.nearest_mm, (offset - offset.dot(normal) * normal).norm());
    }
    return Extent{std::sqrt(found.along_mm), std::sqrt(found.across_mm), found.nearest_mm};
  };
  const Extent disc = extent(Patch::disc), ellipse = extent(Patch::ellipse), jaws = extent(Patch::two_jaws),
               soft = extent(Patch::soft_rim);
  EXPECT_NEAR(disc.along_mm / disc.across_mm, 1, 0.25);
  EXPECT_NEAR(ellipse.along_mm / ellipse.across_mm, 2, 0.4);
  EXPECT_GT(jaws.along_mm / jaws.across_mm, 2);
  EXPECT_GT(jaws.nearest_mm, 0.15 * 4);  // nothing between them
  EXPECT_GT(soft.along_mm, 1.1 * disc.along_mm);
}

TEST_F(TruthBodyTest, TakesAMeanThatFadesAsMovedWithThePatch) {
  const TruthBody soft =
      make_truth_body(organ, 3000, demo.attachments, [](const Vec3&) { return cv::Point2d(); },
                      {{touch, normal, 4, 0, SimulatedTruth::Patch::soft_rim, normal.unitOrthogonal()}});
  const TetModel model(soft.mesh, demo.tissue, soft.fixed_nodes);
  EquilibriumSolver solver(model, {.relative_residual = 1e-8});
  solver.hold(soft.patches[0].footprint);
  const Vec3 pull = 1.2 * normal;
  const Equilibrium held = solver.solve(pull);
  ASSERT_TRUE(held.converged);
  EXPECT_LT((patch_moved_mm(soft.patches[0], held.u) - pull).norm(), 1e-9);
  // The middle gives more than the rim of what is held only in the mean.
  double farthest = 0, nearest = 10;
  for (const auto& sample : soft.patches[0].footprint.samples) {
    const double moved = held.u.segment<3>(3 * sample.nodes[0]).dot(normal);
    farthest = std::max(farthest, moved);
    nearest = std::min(nearest, moved);
  }
  EXPECT_GT(farthest, 1.2);
  EXPECT_LT(nearest, 1.1);
}

TEST_F(TruthBodyTest, RefusesAContactOnAttachedTissue) {
  size_t farthest = 0;
  for (size_t i = 0; i < organ.vertices_mm.size(); ++i)
    if (organ.vertices_mm[i].z() > organ.vertices_mm[farthest].z()) farthest = i;
  EXPECT_THROW(make(organ.vertices_mm[farthest], Vec3::UnitZ()), BadInput);
}

// Two routes to the force besides the multipliers: what the attachments hold, and the work against the energy.
TEST_F(TruthBodyTest, ForceIsWhatTheAttachmentsHoldAndTheSlopeOfTheEnergy) {
  const TetModel model(body.mesh, demo.tissue, body.fixed_nodes);
  EquilibriumOptions precise;
  precise.relative_residual = 1e-8;
  EquilibriumSolver solver(model, precise);
  solver.hold(body.patches[0].footprint);
  const Vec3 pull = 1.5 * normal;
  const double step = 1e-3;
  const auto energy_at = [&](const Vec3& move) { return model.energy(solver.solve(move).u); };
  const Equilibrium held = solver.solve(pull);
  ASSERT_TRUE(held.converged);
  EXPECT_GT(held.force_N.dot(normal), 1);  // a pull outwards is a force outwards on the tissue

  const Eigen::VectorXd internal = model.internal_force(held.u);
  Vec3 at_attachments = Vec3::Zero();
  for (int node : body.fixed_nodes) at_attachments += internal.segment<3>(3 * node);
  EXPECT_NEAR((held.force_N + at_attachments).norm() / held.force_N.norm(), 0, 1e-6);

  for (int k = 0; k < 3; ++k) {
    const Vec3 along = step * Vec3::Unit(k);
    const double slope = (energy_at(pull + along) - energy_at(pull - along)) / (2 * step);
    EXPECT_NEAR(slope, held.force_N[k], 1e-4 * held.force_N.norm());
  }
}

TEST_F(TruthBodyTest, SkinFollowsAnAffineMotionOfTheNodes) {
  const Skin skin = attach_skin(organ.vertices_mm, body.mesh.nodes_mm, body.boundary);
  Eigen::VectorXd u(3 * static_cast<Eigen::Index>(body.mesh.nodes_mm.size()));
  Mat3 gradient;
  gradient << 0.02, -0.01, 0.03, 0.01, 0.04, 0, -0.02, 0.01, -0.03;
  for (size_t i = 0; i < body.mesh.nodes_mm.size(); ++i)
    u.segment<3>(3 * static_cast<Eigen::Index>(i)) = gradient * (body.mesh.nodes_mm[i] - touch) + Vec3(1, 2, 3);
  const std::vector<Vec3> moved = moved_skin(skin, organ.vertices_mm, u);
  for (size_t i = 0; i < moved.size(); ++i) {
    const Vec3 expected = organ.vertices_mm[i] + gradient * (organ.vertices_mm[i] - touch) + Vec3(1, 2, 3);
    EXPECT_LT((moved[i] - expected).norm(), 0.05);  // the mesh's boundary lies up to 1 mm beside the fine surface
  }
}

TEST_F(TruthBodyTest, SkinOfTheBoundaryItselfIsExact) {
  const Skin skin = attach_skin(body.mesh.nodes_mm, body.mesh.nodes_mm, body.boundary);
  Eigen::VectorXd u = Eigen::VectorXd::Random(3 * static_cast<Eigen::Index>(body.mesh.nodes_mm.size()));
  const std::vector<Vec3> moved = moved_skin(skin, body.mesh.nodes_mm, u);
  for (const Triangle& triangle : body.boundary)
    for (int node : triangle) {
      const auto i = static_cast<size_t>(node);
      EXPECT_LT((moved[i] - body.mesh.nodes_mm[i] - u.segment<3>(3 * node)).norm(), 1e-9);
    }
}

}  // namespace
}  // namespace palpate
