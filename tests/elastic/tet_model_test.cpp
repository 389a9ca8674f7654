#include "palpate/elastic/tet_model.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <random>

#include "palpate/elastic/sparse_factor.h"
#include "palpate/elastic/stress.h"
#include "tests/support/meshes.h"
#include "tests/support/prescribed.h"

namespace palpate {
namespace {

const Law kLaws[] = {Law::saint_venant_kirchhoff, Law::saint_venant_kirchhoff_barrier, Law::neo_hookean, Law::corotated,
                     Law::linear};
const std::pair<Law, Element> kCases[] = {{Law::saint_venant_kirchhoff, Element::linear},
                                          {Law::saint_venant_kirchhoff, Element::averaged},
                                          {Law::saint_venant_kirchhoff_barrier, Element::averaged},
                                          {Law::neo_hookean, Element::linear},
                                          {Law::neo_hookean, Element::averaged},
                                          {Law::corotated, Element::linear},
                                          {Law::corotated, Element::averaged},
                                          {Law::linear, Element::linear},
                                          {Law::linear, Element::averaged}};

TissueOptions tissue_of(Law law) {
  return {law, 27, 0.45, ""};
}

Eigen::VectorXd random_displacement(const TetModel& model, double size_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-size_mm, size_mm);
  Eigen::VectorXd u(3 * model.node_count());
  for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = uniform(random);
  return u;
}

Eigen::VectorXd displacement_of(const TetMesh& mesh, const Mat3& F, const Vec3& shift) {
  Eigen::VectorXd u(3 * static_cast<Eigen::Index>(mesh.nodes_mm.size()));
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n)
    u.segment<3>(3 * static_cast<Eigen::Index>(n)) = F * mesh.nodes_mm[n] + shift - mesh.nodes_mm[n];
  return u;
}

TEST(TetModel, ForcesAreTheGradientOfTheEnergy) {
  const TetMesh mesh = test::box_mesh({10, 10, 10}, {2, 2, 2});
  for (const auto& [law, element] : kCases) {
    const TetModel model(mesh, tissue_of(law), {}, element);
    const Eigen::VectorXd u = random_displacement(model, 0.4, 5);
    const Eigen::VectorXd force = model.internal_force(u);
    for (int i = 0; i < u.size(); i += 7) {
      Eigen::VectorXd plus = u, minus = u;
      plus[i] += 1e-5;
      minus[i] -= 1e-5;
      EXPECT_NEAR((model.energy(plus) - model.energy(minus)) / 2e-5, force[i], 1e-7 * force.norm());
    }
  }
}

TEST(TetModel, TheTangentIsTheDerivativeOfTheForcesOnTheUnknowns) {
  const TetMesh mesh = test::box_mesh({10, 10, 10}, {2, 2, 2});
  for (const auto& [law, element] : kCases) {
    const TetModel model(mesh, tissue_of(law), test::nodes_at(mesh, 2, 0), element);
    const Eigen::VectorXd u = model.expand(model.reduce(random_displacement(model, 0.4, 6)));
    Eigen::SparseMatrix<double> lower;
    model.tangent(u, false, lower);
    const Eigen::MatrixXd K = Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
    for (int i = 0; i < model.unknown_count(); i += 5) {
      Eigen::VectorXd step = Eigen::VectorXd::Zero(model.unknown_count());
      step[i] = 1e-5;
      const Eigen::VectorXd plus = model.internal_force(u + model.expand(step)),
                            minus = model.internal_force(u - model.expand(step));
      EXPECT_LT((model.reduce(plus - minus) / 2e-5 - K.col(i)).norm(), 1e-6 * K.col(i).norm());
    }
  }
}

TEST(TetModel, ARigidMotionGivesNoForceAndCarriesTheStressAlong) {
  const TetMesh mesh = test::box_mesh({10, 8, 6}, {2, 2, 2});
  const Mat3 R = Eigen::AngleAxisd(2.1, Vec3(1, -1, 0.5).normalized()).toRotationMatrix();
  for (const auto& [law, element] : kCases) {
    if (law == Law::linear) continue;
    SCOPED_TRACE(law_name(law));
    const TetModel model(mesh, tissue_of(law), {}, element);
    const Eigen::VectorXd u = displacement_of(mesh, R, {30, -10, 4});
    EXPECT_LT(model.internal_force(u).norm(), 1e-12);
    for (double stress : element_von_mises_kPa(model, u)) EXPECT_LT(stress, 1e-9);

    const Eigen::VectorXd bent = random_displacement(model, 0.4, 8);
    Eigen::VectorXd turned(bent.size());
    for (size_t n = 0; n < mesh.nodes_mm.size(); ++n) {
      const Eigen::Index i = 3 * static_cast<Eigen::Index>(n);
      turned.segment<3>(i) = R * (mesh.nodes_mm[n] + bent.segment<3>(i)) + Vec3(30, -10, 4) - mesh.nodes_mm[n];
    }
    const Eigen::VectorXd force = model.internal_force(bent), turned_force = model.internal_force(turned);
    for (Eigen::Index i = 0; i < force.size(); i += 3)
      EXPECT_LT((turned_force.segment<3>(i) - R * force.segment<3>(i)).norm(), 1e-12 * force.norm());
    const auto stress = element_von_mises_kPa(model, bent), turned_stress = element_von_mises_kPa(model, turned);
    for (size_t e = 0; e < stress.size(); ++e) EXPECT_NEAR(turned_stress[e], stress[e], 1e-10 * stress[e]);
  }
}

TEST(TetModel, ThePatchTestHolds) {
  const TetMesh mesh = test::box_mesh({10, 8, 6}, {3, 3, 3});
  std::vector<int> surface_nodes;
  for (const Triangle& t : boundary_triangles(mesh)) surface_nodes.insert(surface_nodes.end(), t.begin(), t.end());
  Mat3 F;
  F << 1.1, 0.05, 0, -0.03, 0.95, 0.02, 0.01, 0, 1.04;
  for (const auto& [law, element] : kCases) {
    SCOPED_TRACE(law_name(law));
    const TetModel model(mesh, tissue_of(law), surface_nodes, element);
    const Eigen::VectorXd force = model.internal_force(displacement_of(mesh, F, {1, 2, 3}));
    EXPECT_GT(model.unknown_count(), 0);
    EXPECT_LT(model.reduce(force).norm(), 1e-12 * force.norm());
  }
}

TEST(TetModel, AHomogeneousDeformationHasTheSameEnergyHoweverItsVolumeRatioIsMeasured) {
  const TetMesh mesh = test::box_mesh({10, 8, 6}, {3, 3, 3});
  Mat3 F;
  F << 1.1, 0.05, 0, -0.03, 0.8, 0.02, 0.01, 0, 1.04;
  const Eigen::VectorXd u = displacement_of(mesh, F, {1, 2, 3});
  for (Law law : kLaws) {
    const double expected = 10 * 8 * 6 * energy_density(law, lame_of(tissue_of(law)), F);
    EXPECT_NEAR(TetModel(mesh, tissue_of(law), {}, Element::linear).energy(u), expected, 1e-12 * expected);
    EXPECT_NEAR(TetModel(mesh, tissue_of(law), {}, Element::averaged).energy(u), expected, 1e-12 * expected);
  }
}

/// Tip deflection of a cantilever 40 x 10 x 10 under an end force, as a fraction of beam theory's.
double fraction_of_the_beams_deflection(Law law, double poisson_ratio, Element element) {
  const TetMesh mesh = test::box_mesh({40, 10, 10}, {16, 4, 4});
  const double E_MPa = 0.027, force_N = 1e-5;
  const TetModel model(mesh, {law, 1e3 * E_MPa, poisson_ratio, ""}, test::nodes_at(mesh, 0, 0), element);
  Eigen::SparseMatrix<double> K;
  model.tangent(Eigen::VectorXd::Zero(3 * model.node_count()), false, K);
  SparseFactor factor;
  factor.analyze(K);
  EXPECT_TRUE(factor.factorize(K));
  const std::vector<int> end = test::nodes_at(mesh, 0, 40);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * model.node_count());
  for (int node : end) load[3 * node + 2] = force_N / static_cast<double>(end.size());
  const Eigen::VectorXd u = model.expand(factor.solve(model.reduce(load)));
  double deflection = 0;
  for (int node : end) deflection += u[3 * node + 2] / static_cast<double>(end.size());
  const double inertia = 1e4 / 12, shear_modulus = E_MPa / (2 * (1 + poisson_ratio));
  const double bending = force_N * 64000 / (3 * E_MPa * inertia), shear = 1.2 * force_N * 40 / (shear_modulus * 100);
  return deflection / (bending + shear);
}

TEST(TetModel, AveragingTheVolumeRatioUnlocksNearlyIncompressibleBending) {
  for (Law law : kLaws) {
    EXPECT_LT(fraction_of_the_beams_deflection(law, 0.499, Element::linear), 0.5);
    EXPECT_NEAR(fraction_of_the_beams_deflection(law, 0.499, Element::averaged), 1, 0.25);
    EXPECT_NEAR(fraction_of_the_beams_deflection(law, 0.3, Element::averaged), 1, 0.2);
  }
}

TEST(TetModel, WhatMovesTheBodyMovesItAlikeWhateverItsModulusAndTheForceIsProportionalToIt) {
  const TetMesh mesh = test::box_mesh({20, 20, 10}, {4, 4, 2});
  std::map<int, Vec3> imposed;
  for (int node : test::nodes_at(mesh, 2, 10)) imposed[node] = Vec3::Zero();
  const int touched = test::nodes_at(mesh, 2, 0)[12];
  imposed[touched] = Vec3(0.5, 0, -2);
  for (const auto& [law, element] : kCases) {
    SCOPED_TRACE(law_name(law));
    const auto solve = [&, law = law, element = element](double E_kPa) {
      const TetModel model(mesh, {law, E_kPa, 0.45, ""}, test::nodes_of(imposed), element);
      return test::solve_prescribed(model, imposed, 2);
    };
    const auto soft = solve(1), stiff = solve(1e5);
    ASSERT_TRUE(soft.converged && stiff.converged);
    EXPECT_LT((stiff.u - soft.u).norm(), 1e-8 * soft.u.norm());
    const Vec3 force = soft.force.segment<3>(3 * touched);
    EXPECT_LT((stiff.force.segment<3>(3 * touched) - 1e5 * force).norm(), 1e-8 * 1e5 * force.norm());
  }
}

TEST(TetModel, ProjectedTangentsArePositiveSemiDefiniteWhereThePlainOnesAreNot) {
  const TetMesh mesh = test::box_mesh({10, 10, 10}, {1, 1, 1});
  const TetModel model(mesh, tissue_of(Law::saint_venant_kirchhoff), {});
  const Eigen::VectorXd u = displacement_of(mesh, Vec3(0.45, 1, 1).asDiagonal(), Vec3::Zero());
  Eigen::SparseMatrix<double> plain, projected;
  model.tangent(u, false, plain);
  model.tangent(u, true, projected);
  const auto smallest = [](const Eigen::SparseMatrix<double>& lower) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
               Eigen::MatrixXd(Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>()))
        .eigenvalues()[0];
  };
  EXPECT_LT(smallest(plain), -1e-3);
  EXPECT_GT(smallest(projected), -1e-12);
}

/// Force that pulls the upper end of a held block of 10 mm up by 0.05 mm.
double pull_N(const TetMesh& mesh, const TissueOptions& tissue, Element element) {
  std::map<int, Vec3> imposed;
  for (int node : test::nodes_at(mesh, 2, 0)) imposed[node] = Vec3::Zero();
  for (int node : test::nodes_at(mesh, 2, 10)) imposed[node] = {0, 0, 0.05};
  const TetModel model(mesh, tissue, test::nodes_of(imposed), element);
  const test::PrescribedEquilibrium found = test::solve_prescribed(model, imposed);
  EXPECT_TRUE(found.converged);
  double sum = 0;
  for (int node : test::nodes_at(mesh, 2, 10)) sum += found.force[3 * node + 2];
  return sum;
}

TEST(TetModel, LabelsGiveElementsAStiffnessOfTheirOwn) {
  TetMesh mesh = test::box_mesh({4, 4, 10}, {2, 2, 6});
  TissueOptions tissue{Law::saint_venant_kirchhoff, 10, 0, ""};
  for (Element element : {Element::linear, Element::averaged}) {
    mesh.label.assign(mesh.tetrahedra.size(), 0);
    tissue.of_label.clear();
    const double soft_N = pull_N(mesh, tissue, element);
    // All of it labelled: another E for the whole body.
    tissue.of_label = {{40, 0}};
    mesh.label.assign(mesh.tetrahedra.size(), 1);
    EXPECT_NEAR(pull_N(mesh, tissue, element) / soft_N, 4, 1e-9);
    // Layers in series, nu = 0: compliances add up, 2 / (1 + 1/4) = 1.6 times the soft one.
    for (size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
      double z = 0;
      for (int node : mesh.tetrahedra[e]) z += mesh.nodes_mm[static_cast<size_t>(node)].z() / 4;
      mesh.label[e] = z > 5;
    }
    EXPECT_NEAR(pull_N(mesh, tissue, element) / soft_N, 1.6, element == Element::linear ? 0.01 : 0.1);
    // A label that the tissue does not know is the first tissue.
    mesh.label.assign(mesh.tetrahedra.size(), 7);
    EXPECT_NEAR(pull_N(mesh, tissue, element) / soft_N, 1, 1e-12);
  }
}

TEST(TetModel, LabelledTissueStillHasForcesThatAreTheGradientOfItsEnergyAndATangentThatIsTheirs) {
  TetMesh mesh = test::box_mesh({4, 4, 10}, {2, 2, 3});
  for (size_t e = 0; e < mesh.tetrahedra.size(); ++e) mesh.label[e] = static_cast<int>(e % 3);
  TissueOptions tissue{Law::neo_hookean, 10, 0.45, ""};
  tissue.of_label = {{80, 0.3}, {3, 0.48}};
  const TetModel model(mesh, tissue, test::nodes_at(mesh, 2, 0), Element::averaged);
  Eigen::VectorXd u(3 * model.node_count()), direction(u.size());
  for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = 0.1 * std::sin(3.0 * i), direction[i] = std::cos(5.0 * i);
  direction = model.expand(model.reduce(direction));
  const double h = 1e-5;
  const double slope = (model.energy(u + h * direction) - model.energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(model.internal_force(u).dot(direction) / slope, 1, 1e-6);
  Eigen::SparseMatrix<double> K;
  model.tangent(u, false, K);
  const Eigen::VectorXd change =
      (model.internal_force(u + h * direction) - model.internal_force(u - h * direction)) / (2 * h);
  const Eigen::VectorXd by_tangent = K.selfadjointView<Eigen::Lower>() * model.reduce(direction);
  EXPECT_LT((model.reduce(change) - by_tangent).norm(), 1e-5 * by_tangent.norm());
}

TEST(SparseFactor, SolvesAndNoticesAnIndefiniteMatrix) {
  const TetMesh mesh = test::box_mesh({10, 10, 10}, {3, 3, 3});
  const TetModel model(mesh, tissue_of(Law::neo_hookean), test::nodes_at(mesh, 2, 0));
  Eigen::SparseMatrix<double> lower;
  model.tangent(Eigen::VectorXd::Zero(3 * model.node_count()), false, lower);
  SparseFactor factor;
  factor.analyze(lower);
  ASSERT_TRUE(factor.factorize(lower));
  const Eigen::MatrixXd B = Eigen::MatrixXd::Random(model.unknown_count(), 3);
  const Eigen::MatrixXd X = factor.solve(B);
  const Eigen::MatrixXd K = Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
  EXPECT_LT((K * X - B).norm(), 1e-9 * B.norm());
  const Eigen::SparseMatrix<double> negative = -lower;
  EXPECT_FALSE(factor.factorize(negative));
}

}  // namespace
}  // namespace palpate
