#include "tests/support/calculix.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "palpate/simulate/organ_shape.h"
#include "palpate/volume/tetrahedralize.h"
#include "tests/support/meshes.h"
#include "tests/support/prescribed.h"

/// The same bodies in CalculiX, a program that shares no code with this one.
namespace palpate {
namespace {

using Imposed = std::map<int, Vec3>;

std::string word(Law law) {
  std::string name = law_name(law);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

struct OneElementState {
  const char* name;
  Mat3 F;
};

std::vector<OneElementState> one_element_states(double size) {
  Mat3 shear = Mat3::Identity(), mixed;
  shear(0, 1) = 0.6 * size;
  mixed << 0.2, 0.3, -0.1, -0.2, -0.3, 0.2, 0.1, 0.2, 0.1;
  mixed = Mat3::Identity() + size * mixed;
  return {{"pulled", Vec3(1 + 0.6 * size, 1, 1).asDiagonal()},
          {"pressed", Vec3(1, 1 - 0.35 * size, 1).asDiagonal()},
          {"sheared", shear},
          {"swollen", (1 + 0.2 * size) * Mat3::Identity()},
          {"shrunk", (1 - 0.2 * size) * Mat3::Identity()},
          {"turned and mixed", Eigen::AngleAxisd(size, Vec3(1, 2, 3).normalized()) * mixed}};
}

class OneElement : public ::testing::TestWithParam<std::pair<Law, double>> {};

TEST_P(OneElement, HasTheForcesAndTheStressOfCalculix) {
  PALPATE_NEEDS_CALCULIX();
  const auto [law, size] = GetParam();
  const TissueOptions tissue{law, 27, 0.45, ""};
  const std::vector<OneElementState> states = one_element_states(size);
  TetMesh mesh;  // one tetrahedron for each state, all at the same place
  Imposed imposed;
  for (const OneElementState& state : states) {
    const int first = static_cast<int>(mesh.nodes_mm.size());
    mesh.tetrahedra.push_back({first, first + 1, first + 2, first + 3});
    for (const Vec3& x : {Vec3(1, 0.5, 0), Vec3(9, 1, 2), Vec3(2, 8, 1), Vec3(3, 2, 10)}) {
      imposed[static_cast<int>(mesh.nodes_mm.size())] = state.F * x - x;
      mesh.nodes_mm.push_back(x);
    }
  }
  const TetModel model(mesh, tissue, {});
  Eigen::VectorXd u(3 * model.node_count());
  for (const auto& [node, displacement] : imposed) u.segment<3>(3 * node) = displacement;
  const Eigen::VectorXd force = model.internal_force(u);
  const test::CalculixAnswer calculix = test::run_calculix(mesh, tissue, imposed);
  for (size_t e = 0; e < states.size(); ++e) {
    const auto ours = force.segment<12>(12 * static_cast<Eigen::Index>(e)),
               theirs = calculix.reaction.segment<12>(12 * static_cast<Eigen::Index>(e));
    EXPECT_LT((ours - theirs).norm(), 1e-5 * ours.norm()) << states[e].name;
    const Mat3 stress = cauchy_stress(law, lame_of(tissue), states[e].F);
    EXPECT_LT((stress - calculix.stress_MPa[e]).norm(), 1e-5 * stress.norm()) << states[e].name;
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, OneElement,
                         ::testing::Values(std::pair{Law::saint_venant_kirchhoff, 1.0},
                                           std::pair{Law::neo_hookean, 1.0}, std::pair{Law::linear, 0.01}),
                         [](const auto& law) { return word(law.param.first); });

/// A body clamped at some nodes, a patch of it moved by `p`.
struct Case {
  TetMesh mesh;
  std::vector<int> clamped, patch;
};

/// 40 x 40 x 20 mm, clamped at z = 20; the patch is the disc of 6 mm in the middle of the face that looks at the
/// camera.
Case block() {
  Case body{test::box_mesh({40, 40, 20}, {8, 8, 4}), {}, {}};
  body.clamped = test::nodes_at(body.mesh, 2, 20);
  for (int node : test::nodes_at(body.mesh, 2, 0))
    if ((body.mesh.nodes_mm[static_cast<size_t>(node)] - Vec3(20, 20, 0)).norm() < 6) body.patch.push_back(node);
  return body;
}

/// A pear of 60 x 45 x 30 mm, clamped in its rear third; the patch is what lies within 7 mm of its foremost node.
Case organ() {
  SimulatedBody shape;
  shape.shape = "pear";
  shape.size_mm = {60, 45, 30};
  shape.center_mm = {0, 0, 100};
  Case body{tetrahedralize(make_organ(shape, 2000), 1344), {}, {}};
  const std::vector<Vec3>& nodes = body.mesh.nodes_mm;
  const auto by_depth = [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); };
  const Vec3 front = *std::min_element(nodes.begin(), nodes.end(), by_depth);
  for (size_t n = 0; n < nodes.size(); ++n) {
    if (nodes[n].z() > 105) body.clamped.push_back(static_cast<int>(n));
    if ((nodes[n] - front).norm() < 7) body.patch.push_back(static_cast<int>(n));
  }
  return body;
}

/// Against CalculiX on the same mesh: the force on the patch, and the displacement of every node.
void expect_agreement(const Case& body, const TissueOptions& tissue, const Vec3& p, int steps) {
  ASSERT_FALSE(body.clamped.empty());
  ASSERT_GE(body.patch.size(), 3u);
  Imposed imposed;
  for (int node : body.clamped) imposed[node] = Vec3::Zero();
  for (int node : body.patch) imposed[node] = p;
  const TetModel model(body.mesh, tissue, test::nodes_of(imposed));
  const test::PrescribedEquilibrium ours = test::solve_prescribed(model, imposed, steps);
  ASSERT_TRUE(ours.converged);
  const test::CalculixAnswer theirs = test::run_calculix(body.mesh, tissue, imposed);
  Vec3 our_force = Vec3::Zero(), their_force = Vec3::Zero();
  for (int node : body.patch) {
    our_force += ours.force.segment<3>(3 * node);
    their_force += theirs.reaction.segment<3>(3 * node);
  }
  const double force_error = (our_force - their_force).norm() / their_force.norm();
  double displacement_error = 0;
  for (Eigen::Index i = 0; i < ours.u.size(); i += 3)
    displacement_error = std::max(displacement_error, (ours.u - theirs.u).segment<3>(i).norm() / p.norm());
  EXPECT_LT(force_error, 1e-5);
  EXPECT_LT(displacement_error, 1e-5);
  const auto record = [](const char* key, double value) {
    ::testing::Test::RecordProperty(key, fmt::format("{:.3g}", value));
  };
  record("force_N", our_force.norm());
  record("smallest_volume_ratio", model.smallest_volume_ratio(ours.u));
  record("force_error", force_error);
  record("displacement_error", displacement_error);
}

class Body : public ::testing::TestWithParam<std::pair<Law, Vec3>> {};

TEST_P(Body, ABlockMovedByThirtyPercentOfItsDepthAgreesWithCalculix) {
  PALPATE_NEEDS_CALCULIX();
  const auto [law, direction] = GetParam();
  expect_agreement(block(), {law, 27, 0.45, ""}, 6 * direction, 3);
}

TEST_P(Body, AnOrganMovedByThirtyPercentOfItsDepthAgreesWithCalculix) {
  PALPATE_NEEDS_CALCULIX();
  const auto [law, direction] = GetParam();
  expect_agreement(organ(), {law, 400, 0.35, ""}, 9 * direction, 3);
}

INSTANTIATE_TEST_SUITE_P(Laws, Body,
                         ::testing::Values(std::pair{Law::saint_venant_kirchhoff, Vec3(0, 0, -1)},
                                           std::pair{Law::saint_venant_kirchhoff, Vec3(1, 0, 0)},
                                           std::pair{Law::neo_hookean, Vec3(0, 0, -1)},
                                           std::pair{Law::neo_hookean, Vec3(1, 0, 0)},
                                           std::pair{Law::linear, Vec3(0, 0, -1)},
                                           std::pair{Law::linear, Vec3(1, 0, 0)}),
                         [](const auto& gesture) {
                           return word(gesture.param.first) + (gesture.param.second.x() == 0 ? "_pulled" : "_sheared");
                         });

}  // namespace
}  // namespace palpate
