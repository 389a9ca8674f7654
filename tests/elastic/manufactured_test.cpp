#include <gtest/gtest.h>

#include <cmath>

#include "palpate/elastic/sparse_factor.h"
#include "palpate/elastic/tet_model.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

constexpr double kEdge_mm = 1;

/// u = c f(x) f(y) f(z) with f(t) = sin(t + 1/2), imposed on the faces of the unit cube; the body force is minus the
/// divergence of Hooke's stress: -((lambda + mu) grad div u + mu laplace u).
struct Manufactured {
  Lame lame;
  Vec3 c = Vec3(1, -0.5, 0.7);

  static double f(double t) { return std::sin(t + 0.5); }
  static double slope(double t) { return std::cos(t + 0.5); }

  Vec3 u(const Vec3& x) const { return f(x[0]) * f(x[1]) * f(x[2]) * c; }

  Mat3 gradient(const Vec3& x) const {
    return c * Vec3(slope(x[0]) * f(x[1]) * f(x[2]), f(x[0]) * slope(x[1]) * f(x[2]), f(x[0]) * f(x[1]) * slope(x[2]))
                   .transpose();
  }

  Vec3 body_force(const Vec3& x) const {
    Mat3 hessian = -f(x[0]) * f(x[1]) * f(x[2]) * Mat3::Identity();
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      hessian(i, j) = hessian(j, i) = slope(x[i]) * slope(x[j]) * f(x[k]);
    }
    return -((lame.lambda + lame.mu) * (hessian * c) - 3 * lame.mu * u(x));
  }
};

/// Calls `visit(weight, barycentric)` for the points of a product rule of degree five; the weights sum to one.
template <class Visit>
void for_each_point(Visit visit) {
  const double near = 0.5 * std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(1.2)),
               far = 0.5 * std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(1.2));
  const double heavy = (18 + std::sqrt(30.0)) / 72, light = (18 - std::sqrt(30.0)) / 72;
  const std::pair<double, double> gauss[] = {
      {0.5 - far, light}, {0.5 - near, heavy}, {0.5 + near, heavy}, {0.5 + far, light}};
  for (const auto& [r, wr] : gauss)
    for (const auto& [s, ws] : gauss)
      for (const auto& [t, wt] : gauss) {
        const Eigen::Vector4d b((1 - r) * (1 - s) * (1 - t), r, s * (1 - r), t * (1 - r) * (1 - s));
        visit(6 * wr * ws * wt * (1 - r) * (1 - r) * (1 - s), b);
      }
}

struct Errors {
  double l2 = 0, energy = 0;
};

Errors errors_of(int cells, double poisson_ratio, Element element) {
  const TetMesh mesh = test::box_mesh({kEdge_mm, kEdge_mm, kEdge_mm}, {cells, cells, cells});
  std::vector<int> faces;
  for (int axis = 0; axis < 3; ++axis)
    for (double end : {0.0, kEdge_mm})
      for (int node : test::nodes_at(mesh, axis, end)) faces.push_back(node);
  const TetModel model(mesh, {Law::linear, 27, poisson_ratio, ""}, faces, element);
  const Manufactured exact{lame_of(model.tissue())};
  const auto at = [&mesh](const Tetrahedron& t, const Eigen::Vector4d& b) {
    Vec3 x = Vec3::Zero();
    for (size_t a = 0; a < 4; ++a) x += b[static_cast<Eigen::Index>(a)] * mesh.nodes_mm[static_cast<size_t>(t[a])];
    return x;
  };

  Eigen::VectorXd imposed = Eigen::VectorXd::Zero(3 * model.node_count()), load = imposed;
  for (int node : faces) imposed.segment<3>(3 * node) = exact.u(mesh.nodes_mm[static_cast<size_t>(node)]);
  for (int e = 0; e < model.element_count(); ++e)
    for_each_point([&](double weight, const Eigen::Vector4d& b) {
      const Tetrahedron& t = mesh.tetrahedra[static_cast<size_t>(e)];
      const Vec3 force = weight * model.rest_volume_mm3(e) * exact.body_force(at(t, b));
      for (size_t a = 0; a < 4; ++a) load.segment<3>(3 * t[a]) += b[static_cast<Eigen::Index>(a)] * force;
    });
  Eigen::SparseMatrix<double> K;
  model.tangent(Eigen::VectorXd::Zero(load.size()), false, K);
  SparseFactor factor;
  factor.analyze(K);
  EXPECT_TRUE(factor.factorize(K));
  const Eigen::VectorXd u = imposed + model.expand(factor.solve(model.reduce(load - model.internal_force(imposed))));

  Errors squared;
  for (int e = 0; e < model.element_count(); ++e)
    for_each_point([&](double weight, const Eigen::Vector4d& b) {
      const Tetrahedron& t = mesh.tetrahedra[static_cast<size_t>(e)];
      const Vec3 x = at(t, b);
      Vec3 found = Vec3::Zero();
      for (size_t a = 0; a < 4; ++a) found += b[static_cast<Eigen::Index>(a)] * u.segment<3>(3 * t[a]);
      const double volume = weight * model.rest_volume_mm3(e);
      squared.l2 += volume * (found - exact.u(x)).squaredNorm();
      squared.energy +=
          volume * energy_density(Law::linear, exact.lame, model.deformation_gradient(u, e) - exact.gradient(x));
    });
  return {std::sqrt(squared.l2), std::sqrt(squared.energy)};
}

void expect_slopes(double poisson_ratio, Element element) {
  const Errors coarse = errors_of(8, poisson_ratio, element), fine = errors_of(16, poisson_ratio, element);
  const double l2_slope = std::log2(coarse.l2 / fine.l2), energy_slope = std::log2(coarse.energy / fine.energy);
  EXPECT_GE(l2_slope, 1.95) << "nu = " << poisson_ratio;
  EXPECT_GE(energy_slope, 0.95) << "nu = " << poisson_ratio;
}

TEST(Manufactured, LinearElementsConvergeAsTheoryHasIt) {
  for (double nu : {0.0, 0.3, 0.45}) expect_slopes(nu, Element::linear);
}

TEST(Manufactured, AveragedElementsConvergeAsTheoryHasIt) {
  for (double nu : {0.0, 0.3, 0.45, 0.49}) expect_slopes(nu, Element::averaged);
}

}  // namespace
}  // namespace palpate
