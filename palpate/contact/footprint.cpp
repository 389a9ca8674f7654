#include "palpate/contact/footprint.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace palpate {

namespace {

/// A mean whose node weights (squared) keep less than this once their part in the means before is gone adds nothing
/// that the mesh could tell apart. On a fine mesh half is left.
constexpr double kMinIndependentPart = 0.1;
/// Rings of the disc and points on each.
constexpr int kRings = 8, kRingPoints = 24;
/// Up to which degree the disc is tied, and what that adds: on triangles with edges h it acts like one larger by
/// `growth_per_edge` times h: what makes the force of flat punches on averaged elements that of a fine mesh (h between
/// 0.2 and 0.7 of the radius, nu between 0.3 and 0.49; single meshes differ by 0.06).
struct Order {
  int degree;
  double growth_per_edge;
};
constexpr std::array<Order, 5> kOrders = {{{7, 0.50}, {5, 0.46}, {3, 0.39}, {1, 0.30}, {0, 0.30}}};
/// Of the radius, what that correction leaves at least.
constexpr double kMinRadiusFraction = 0.3;

/// A point of the unit disc and the fraction of a rigid punch's force around it.
struct DiscPoint {
  Eigen::Vector2d at;
  double weight = 0;
};

/// With rho = sin t the fraction of the force 2 pi rho d rho / sqrt(1 - rho^2) is 2 pi sin t dt, which is smooth.
std::vector<DiscPoint> rigid_disc() {
  std::vector<DiscPoint> points;
  for (int ring = 0; ring < kRings; ++ring) {
    const double t = 0.5 * std::numbers::pi * (ring + 0.5) / kRings;
    for (int i = 0; i < kRingPoints; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.5 * (ring % 2)) / kRingPoints;
      points.push_back({std::sin(t) * Eigen::Vector2d(std::cos(angle), std::sin(angle)), std::sin(t)});
    }
  }
  return points;
}

/// Where a line along `normal` through `point` meets the surface, nearest to `point`.
std::optional<Footprint::Sample> sample_along(const std::vector<Vec3>& nodes, const std::vector<Triangle>& boundary,
                                              const Vec3& point, const Vec3& normal) {
  std::optional<Footprint::Sample> nearest;
  double min_height = std::numeric_limits<double>::infinity();
  for (const Triangle& t : boundary) {
    const Vec3& a = nodes[static_cast<size_t>(t[0])];
    const Vec3 ab = nodes[static_cast<size_t>(t[1])] - a, ac = nodes[static_cast<size_t>(t[2])] - a;
    const Vec3 doubled_area = ab.cross(ac);
    const double slope = doubled_area.dot(normal);
    if (slope <= 0) continue;
    const double height = doubled_area.dot(a - point) / slope;
    if (std::abs(height) >= min_height) continue;
    const Vec3 offset = point + height * normal - a;
    const double v = offset.cross(ac).dot(doubled_area) / doubled_area.squaredNorm();
    const double w = ab.cross(offset).dot(doubled_area) / doubled_area.squaredNorm();
    constexpr double kTolerance = -1e-9;
    if (v < kTolerance || w < kTolerance || 1 - v - w < kTolerance) continue;
    min_height = std::abs(height);
    nearest = Footprint::Sample{t, Vec3(1 - v - w, v, w)};
  }
  return nearest;
}

using SparseRow = std::map<int, double>;  // node -> weight

double dot(const SparseRow& a, const SparseRow& b) {
  double sum = 0;
  for (const auto& [node, weight] : a)
    if (const auto found = b.find(node); found != b.end()) sum += weight * found->second;
  return sum;
}

/// Gram-Schmidt over the nodes; false when the mean adds no new direction. `basis` takes it in.
bool adds_a_direction(SparseRow row, std::vector<SparseRow>& basis) {
  const double before = dot(row, row);
  if (before < 1e-12) return false;
  for (const SparseRow& direction : basis) {
    const double along = dot(row, direction);
    for (const auto& [node, weight] : direction) row[node] -= along * weight;
  }
  const double left = dot(row, row);
  if (left < kMinIndependentPart * before) return false;
  for (auto& entry : row) entry.second /= std::sqrt(left);
  basis.push_back(row);
  return true;
}

/// The weights of a mean of samples on the free nodes.
SparseRow on_nodes(const TetModel& model, const std::vector<Footprint::Sample>& samples, const Eigen::VectorXd& mean) {
  SparseRow row;
  for (size_t s = 0; s < samples.size(); ++s)
    for (int c = 0; c < 3; ++c)
      if (const int node = samples[s].nodes[static_cast<size_t>(c)]; !model.is_fixed(node))
        row[node] += mean[static_cast<Eigen::Index>(s)] * samples[s].barycentric[c];
  return row;
}

/// Edge of the equilateral triangle with the area of this one.
double edge_mm(const std::vector<Vec3>& nodes, const Triangle& t) {
  const Vec3& a = nodes[static_cast<size_t>(t[0])];
  const Vec3 doubled_area = (nodes[static_cast<size_t>(t[1])] - a).cross(nodes[static_cast<size_t>(t[2])] - a);
  return std::sqrt(doubled_area.norm() * 2 / std::sqrt(3.0));
}

/// The disc laid on the surface; points beyond its rim are left out, and its middle stands in where all are.
struct LaidDisc {
  std::vector<Footprint::Sample> samples;
  std::vector<DiscPoint> points;
};

LaidDisc lay_disc(const std::vector<Vec3>& nodes, const std::vector<Triangle>& boundary, const Footprint& footprint,
                  const Footprint::Sample& middle, double radius_mm) {
  const Vec3 tangent = footprint.normal.unitOrthogonal(), bitangent = footprint.normal.cross(tangent);
  LaidDisc disc;
  for (const DiscPoint& q : rigid_disc()) {
    const Vec3 point = footprint.center_mm + radius_mm * (q.at[0] * tangent + q.at[1] * bitangent);
    const auto sample = sample_along(nodes, boundary, point, footprint.normal);
    if (!sample) continue;
    disc.samples.push_back(*sample);
    disc.points.push_back(q);
  }
  if (disc.samples.empty()) return {{middle}, {{Eigen::Vector2d::Zero(), 1}}};
  return disc;
}

/// Mean edge under the disc, weighted as the force is.
double edge_under(const LaidDisc& disc, const std::vector<Vec3>& nodes) {
  double sum = 0, weights = 0;
  for (size_t s = 0; s < disc.samples.size(); ++s) {
    sum += disc.points[s].weight * edge_mm(nodes, disc.samples[s].nodes);
    weights += disc.points[s].weight;
  }
  return weights > 0 ? sum / weights : 0;
}

/// One row per mean, one column per sample; rows sum to one. Weight functions are 1 + q with q the polynomials up to
/// `degree`, orthonormal under the punch's pressure.
Eigen::MatrixXd means_of(const LaidDisc& disc, int degree) {
  Eigen::VectorXd fraction(static_cast<Eigen::Index>(disc.points.size()));
  Eigen::MatrixXd monomials(fraction.size(), (degree + 1) * (degree + 2) / 2);
  for (Eigen::Index s = 0; s < fraction.size(); ++s) {
    const DiscPoint& point = disc.points[static_cast<size_t>(s)];
    fraction[s] = point.weight;
    Eigen::Index column = 0;
    for (int total = 0; total <= degree; ++total)
      for (int of_y = 0; of_y <= total; ++of_y)
        monomials(s, column++) = std::pow(point.at[0], total - of_y) * std::pow(point.at[1], of_y);
  }
  fraction /= fraction.sum();
  const Eigen::VectorXd root = fraction.cwiseSqrt();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(root.asDiagonal() * monomials);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(fraction.size(), monomials.cols());
  Eigen::MatrixXd means = (root.asDiagonal() * q).transpose();
  means.row(0) = fraction;
  for (Eigen::Index m = 1; m < means.rows(); ++m) means.row(m) += fraction;
  return means;
}

/// The triangles that a disc of this radius can lie on.
std::vector<Triangle> triangles_near(const std::vector<Vec3>& nodes, const std::vector<Triangle>& boundary,
                                     const Vec3& center, double radius_mm) {
  std::vector<Triangle> near;
  for (const Triangle& t : boundary) {
    const Vec3 &a = nodes[static_cast<size_t>(t[0])], &b = nodes[static_cast<size_t>(t[1])],
               &c = nodes[static_cast<size_t>(t[2])];
    const Vec3 middle = (a + b + c) / 3;
    const double reach_mm = std::max({(a - middle).norm(), (b - middle).norm(), (c - middle).norm()});
    if ((middle - center).norm() < reach_mm + 2 * radius_mm) near.push_back(t);
  }
  return near;
}

bool are_independent(const TetModel& model, const Footprint& footprint) {
  std::vector<SparseRow> basis;
  for (Eigen::Index m = 0; m < footprint.means.rows(); ++m)
    if (!adds_a_direction(on_nodes(model, footprint.samples, footprint.means.row(m)), basis)) return false;
  return true;
}

}  // namespace

Footprint make_footprint(const TetModel& model, const std::vector<Triangle>& boundary, const Vec3& near_mm,
                         double radius_mm) {
  const std::vector<Vec3>& nodes = model.rest_mm();
  const ClosestPoint middle = closest_point(near_mm, nodes, boundary);
  if (middle.triangle < 0) throw std::invalid_argument("make_footprint: the body has no surface");
  Footprint footprint;
  footprint.center_mm = middle.point;
  const std::vector<Vec3> normals = vertex_normals(nodes, boundary);
  const Triangle& t = boundary[static_cast<size_t>(middle.triangle)];
  footprint.normal = Vec3::Zero();
  for (int c = 0; c < 3; ++c)
    footprint.normal += middle.barycentric[c] * normals[static_cast<size_t>(t[static_cast<size_t>(c)])];
  footprint.normal.normalize();

  const Footprint::Sample at_middle{t, middle.barycentric};
  const std::vector<Triangle> near = triangles_near(nodes, boundary, footprint.center_mm, radius_mm);
  const double edge = edge_under(lay_disc(nodes, near, footprint, at_middle, radius_mm), nodes);
  for (const Order& order : kOrders) {
    const double effective_mm = std::max(radius_mm - order.growth_per_edge * edge, kMinRadiusFraction * radius_mm);
    const LaidDisc disc = lay_disc(nodes, near, footprint, at_middle, effective_mm);
    footprint.samples = disc.samples;
    footprint.means = means_of(disc, order.degree);
    if (are_independent(model, footprint)) break;
  }
  return footprint;
}

Eigen::SparseMatrix<double> constraint_matrix(const TetModel& model, const Footprint& footprint) {
  const auto samples = static_cast<Eigen::Index>(footprint.samples.size());
  const Eigen::MatrixXd tied =
      footprint.means.size() > 0 ? footprint.means : Eigen::MatrixXd::Identity(samples, samples);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index row = 0; row < tied.rows(); ++row)
    for (const auto& [node, weight] : on_nodes(model, footprint.samples, tied.row(row)))
      for (int i = 0; i < 3 && weight != 0; ++i)
        entries.emplace_back(3 * static_cast<int>(row) + i, model.first_unknown(node) + i, weight);
  Eigen::SparseMatrix<double> J(3 * tied.rows(), model.unknown_count());
  J.setFromTriplets(entries.begin(), entries.end());
  return J;
}

}  // namespace palpate
