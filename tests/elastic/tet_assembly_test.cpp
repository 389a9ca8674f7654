#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <set>

#include "palpate/elastic/colored_batches.h"
#include "palpate/elastic/tet_model.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

/// Enough elements for several threads.
const TetMesh& large_mesh() {
  static const TetMesh mesh = test::box_mesh({60, 30, 30}, {20, 10, 10});
  return mesh;
}

Eigen::VectorXd random_vector(Eigen::Index size, double largest, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-largest, largest);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return uniform(random); });
}

TEST(TetAssembly, ForcesOfManyElementsAreTheSumOfTheirPiolaStresses) {
  const TetMesh& mesh = large_mesh();
  for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean, Law::corotated, Law::linear}) {
    const TissueOptions tissue{law, 27, 0.45, ""};
    const TetModel model(mesh, tissue, {});
    const Eigen::VectorXd u = random_vector(3 * model.node_count(), 0.3, 7);
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(u.size());
    for (int e = 0; e < model.element_count(); ++e) {
      const Tetrahedron& t = mesh.tetrahedra[static_cast<size_t>(e)];
      Mat3 edges;
      for (int c = 0; c < 3; ++c)
        edges.col(c) = mesh.nodes_mm[static_cast<size_t>(t[static_cast<size_t>(c) + 1])] -
                       mesh.nodes_mm[static_cast<size_t>(t[0])];
      const Mat3 H = model.rest_volume_mm3(e) *
                     first_piola_stress(law, lame_of(tissue), model.deformation_gradient(u, e)) *
                     edges.inverse().transpose();
      for (int c = 0; c < 3; ++c) {
        expected.segment<3>(3 * t[static_cast<size_t>(c) + 1]) += H.col(c);
        expected.segment<3>(3 * t[0]) -= H.col(c);
      }
    }
    EXPECT_LT((model.internal_force(u) - expected).norm(), 1e-12 * expected.norm()) << law_name(law);
  }
}

TEST(TetAssembly, TheTangentOfManyElementsIsTheDerivativeOfTheirForces) {
  const TetMesh& mesh = large_mesh();
  for (Element element : {Element::linear, Element::averaged})
    for (Law law : {Law::saint_venant_kirchhoff, Law::neo_hookean}) {
      const TetModel model(mesh, {law, 27, 0.45, ""}, test::nodes_at(mesh, 2, 0), element);
      const Eigen::VectorXd u = model.expand(random_vector(model.unknown_count(), 0.2, 8));
      const Eigen::VectorXd v = random_vector(model.unknown_count(), 1, 9);
      Eigen::SparseMatrix<double> K;
      model.tangent(u, false, K);
      const double h = 1e-5;
      const Eigen::VectorXd difference =
          model.reduce(model.internal_force(u + h * model.expand(v)) - model.internal_force(u - h * model.expand(v))) /
          (2 * h);
      const Eigen::VectorXd derivative = K.selfadjointView<Eigen::Lower>() * v;
      EXPECT_LT((difference - derivative).norm(), 1e-7 * derivative.norm()) << law_name(law);
    }
}

TEST(ColoredBatches, RangesOfOnePhaseHaveNoSlabInCommonAndEveryItemComesOnce) {
  std::mt19937 random(3);
  std::vector<int> min, max;
  for (int i = 0; i < 500; ++i) {
    min.push_back(static_cast<int>(random() % 8));
    max.push_back(std::min(7, min.back() + static_cast<int>(random() % 3)));
  }
  const ColoredBatches batches = color_batches(min, max, 8);
  EXPECT_EQ(std::set<int>(batches.order.begin(), batches.order.end()).size(), 500);
  size_t covered = 0;
  for (const auto& ranges : batches.batches) {
    std::set<int> taken;
    for (const ColoredBatches::Range& range : ranges) {
      covered += static_cast<size_t>(range.end - range.begin);
      std::set<int> slabs;
      for (int i = range.begin; i < range.end; ++i) {
        const auto item = static_cast<size_t>(batches.order[static_cast<size_t>(i)]);
        for (int slab = min[item]; slab <= max[item]; ++slab) slabs.insert(slab);
      }
      for (int slab : slabs) EXPECT_TRUE(taken.insert(slab).second) << slab;
    }
  }
  EXPECT_EQ(covered, 500);
}

}  // namespace
}  // namespace palpate
