#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "palpate/elastic/sparse_factor.h"
#include "palpate/elastic/tet_model.h"

namespace palpate {
namespace {

constexpr double kRadius_mm = 2;        // a: of the punch
constexpr double kBlock_mm = 12 * 2.0;  // radius and depth of the block
constexpr double kDepth_mm = 0.01;      // d: the punch moves in by this; the linear law scales with it
constexpr double kTolerance_mm = 1e-9;

/// Steps that begin with `first` and grow by `growth` until they have come from `from` to `to`.
std::vector<double> graded(double from, double to, double first, double growth) {
  std::vector<double> at;
  double step = first, sum = 0;
  for (; sum < to - from; step *= growth) at.push_back(sum += step);
  for (double& x : at) x = from + x * (to - from) / sum;
  return at;
}

/// A quarter of a thick round block whose face z = 0 the punch meets around the z axis; `sectors` elements along the
/// rim of the punch, rings and layers finest there.
TetMesh quarter_block(int sectors) {
  std::vector<double> radii;
  for (int ring = 0; ring <= sectors; ++ring)
    radii.push_back(kRadius_mm * (1 - std::pow(1 - static_cast<double>(ring) / sectors, 1.5)));
  const double first = radii.back() - radii[radii.size() - 2], growth = 1 + 2.0 / sectors;
  for (double r : graded(kRadius_mm, kBlock_mm, first, growth)) radii.push_back(r);
  std::vector<double> depths = graded(0, kBlock_mm, first, growth);
  depths.insert(depths.begin(), 0);

  // Rings of the face: one more sector from ring to ring up to the rim.
  std::vector<Eigen::Vector2d> points;
  std::vector<Triangle> triangles;
  int inner = 0, inner_sectors = 0;
  for (size_t ring = 0; ring < radii.size(); ++ring) {
    const int outer = static_cast<int>(points.size()), outer_sectors = std::min(static_cast<int>(ring), sectors);
    for (int i = 0; i <= outer_sectors; ++i) {
      const double angle = outer_sectors == 0 ? 0 : 0.5 * std::numbers::pi * i / outer_sectors;
      points.emplace_back(radii[ring] * std::cos(angle), radii[ring] * std::sin(angle));
    }
    for (int i = 0; i < outer_sectors; ++i) triangles.push_back({inner + i, outer + i, outer + i + 1});
    for (int i = 0; i < inner_sectors; ++i) triangles.push_back({inner + i, outer + i + 1, inner + i + 1});
    inner = outer;
    inner_sectors = outer_sectors;
  }

  TetMesh mesh;
  for (double z : depths)
    for (const Eigen::Vector2d& p : points) mesh.nodes_mm.emplace_back(p[0], p[1], z);
  const int layer = static_cast<int>(points.size());
  for (size_t k = 0; k + 1 < depths.size(); ++k)
    for (Triangle t : triangles) {
      // A prism into three tetrahedra; the order of the numbers makes neighbours cut their common face alike.
      std::sort(t.begin(), t.end());
      const int below = layer * static_cast<int>(k), above = below + layer;
      for (Tetrahedron tet : {Tetrahedron{below + t[0], below + t[1], below + t[2], above + t[2]},
                              Tetrahedron{below + t[0], below + t[1], above + t[1], above + t[2]},
                              Tetrahedron{below + t[0], above + t[0], above + t[1], above + t[2]}}) {
        const auto at = [&mesh](int n) { return mesh.nodes_mm[static_cast<size_t>(n)]; };
        if (signed_volume_mm3(at(tet[0]), at(tet[1]), at(tet[2]), at(tet[3])) < 0) std::swap(tet[2], tet[3]);
        mesh.tetrahedra.push_back(tet);
      }
    }
  return mesh;
}

/// Displacement of a half-space under a normal point force at the origin (Boussinesq), z into the body. Far from the
/// punch it is that of the punch up to (a / distance)^2 of itself.
Vec3 boussinesq(double force_N, double E_MPa, double nu, const Vec3& x) {
  const double distance = x.norm(), r = x.head<2>().norm();
  const double scale = force_N * (1 + nu) / (2 * std::numbers::pi * E_MPa * distance);
  const double along_r = scale * (r * x.z() / (distance * distance) - (1 - 2 * nu) * r / (distance + x.z()));
  Vec3 u(0, 0, scale * (x.z() * x.z() / (distance * distance) + 2 * (1 - nu)));
  if (r > 0) u.head<2>() = along_r / r * x.head<2>();
  return u;
}

/// Solves K u = 0 at the entries of u that are not held; the linear law only.
Eigen::VectorXd relax(const TetModel& model, const Eigen::VectorXd& imposed, const std::vector<bool>& held) {
  std::vector<int> unknown(held.size(), -1), entry_of_u;
  for (size_t i = 0; i < held.size(); ++i) {
    if (held[i]) continue;
    unknown[i] = static_cast<int>(entry_of_u.size());
    entry_of_u.push_back(static_cast<int>(i));
  }
  Eigen::SparseMatrix<double> lower;
  model.tangent(Eigen::VectorXd::Zero(imposed.size()), false, lower);
  std::vector<Eigen::Triplet<double>> entries;
  for (int column : entry_of_u)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower, column); entry; ++entry)
      if (const int row = unknown[static_cast<size_t>(entry.row())]; row >= 0)
        entries.emplace_back(row, unknown[static_cast<size_t>(column)], entry.value());
  const auto size = static_cast<Eigen::Index>(entry_of_u.size());
  Eigen::SparseMatrix<double> K(size, size);
  K.setFromTriplets(entries.begin(), entries.end());
  SparseFactor factor;
  factor.analyze(K);
  EXPECT_TRUE(factor.factorize(K));
  const Eigen::VectorXd force = model.internal_force(imposed);
  Eigen::VectorXd u = imposed;
  u(entry_of_u) += factor.solve(-force(entry_of_u));
  return u;
}

/// Force of a rigid, frictionless, flat round punch over that of the half-space, 2 a E d / (1 - nu^2) (Sneddon 1965).
/// The outer faces move as the half-space does there, so that the block's size does not count.
double fraction_of_the_half_spaces_force(int sectors, double nu, Element element) {
  const TetMesh mesh = quarter_block(sectors);
  const TetModel model(mesh, {Law::linear, 27, nu, ""}, {}, element);
  const double E_MPa = model.tissue().young_modulus_MPa();
  const double expected_N = 2 * kRadius_mm * E_MPa * kDepth_mm / (1 - nu * nu);
  Eigen::VectorXd imposed = Eigen::VectorXd::Zero(3 * model.node_count());
  std::vector<bool> held(static_cast<size_t>(imposed.size()), false);
  std::vector<int> punch_z;
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n) {
    const Vec3& x = mesh.nodes_mm[n];
    const Eigen::Index i = 3 * static_cast<Eigen::Index>(n);
    const bool outside = x.head<2>().norm() > kBlock_mm - kTolerance_mm || x.z() > kBlock_mm - kTolerance_mm;
    const bool under_punch = x.z() == 0 && x.head<2>().norm() < kRadius_mm + kTolerance_mm;
    if (outside) imposed.segment<3>(i) = boussinesq(expected_N, E_MPa, nu, x);
    if (under_punch) {
      imposed[i + 2] = kDepth_mm;
      punch_z.push_back(static_cast<int>(i) + 2);
    }
    held[3 * n] = outside || x.x() < kTolerance_mm;  // planes of symmetry
    held[3 * n + 1] = outside || x.y() < kTolerance_mm;
    held[3 * n + 2] = outside || under_punch;
  }
  const Eigen::VectorXd force = model.internal_force(relax(model, imposed, held));
  return 4 * force(punch_z).sum() / expected_N;
}

/// The pressure is singular at the rim, so the force converges with the first power of the edge.
void expect_convergence(int sectors, double nu, Element element) {
  const double coarse = fraction_of_the_half_spaces_force(sectors / 2, nu, element),
               fine = fraction_of_the_half_spaces_force(sectors, nu, element);
  ::testing::Test::RecordProperty("coarse", fmt::format("{:.4f}", coarse));
  ::testing::Test::RecordProperty("fine", fmt::format("{:.4f}", fine));
  EXPECT_NEAR(fine, 1, 0.02) << "nu = " << nu;
  EXPECT_LT(std::abs(fine - 1), 0.55 * std::abs(coarse - 1)) << "nu = " << nu;
}

TEST(FlatPunch, LinearElementsConvergeToTheClosedForm) {
  expect_convergence(14, 0.3, Element::linear);
}

TEST(FlatPunch, AveragedElementsConvergeToTheClosedFormInNearlyIncompressibleTissue) {
  expect_convergence(10, 0.45, Element::averaged);
}

}  // namespace
}  // namespace palpate
