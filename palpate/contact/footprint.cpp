#include "palpate/contact/footprint.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace palpate {

namespace {

/// A row of sample weights shorter than this (squared) once its part in the rows taken before is gone adds nothing that
/// the mesh could tell apart.
constexpr double kLeastIndependentPart = 0.15;

/// Concentric rings of points in the unit disc, from the rim inwards: the rim decides the force of a rigid patch.
std::vector<Eigen::Vector2d> disc_pattern() {
  std::vector<Eigen::Vector2d> points;
  for (const auto& [radius, count] : {std::pair{1.0, 12}, std::pair{0.5, 6}, std::pair{0.0, 1}})
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
  return points;
}

/// Where a line along `normal` through `point` meets the surface, nearest to `point`.
std::optional<Footprint::Sample> sample_along(const std::vector<Vec3>& nodes, const std::vector<Triangle>& boundary,
                                              const Vec3& point, const Vec3& normal) {
  std::optional<Footprint::Sample> nearest;
  double least_height = std::numeric_limits<double>::infinity();
  for (const Triangle& t : boundary) {
    const Vec3& a = nodes[static_cast<size_t>(t[0])];
    const Vec3 ab = nodes[static_cast<size_t>(t[1])] - a, ac = nodes[static_cast<size_t>(t[2])] - a;
    const Vec3 doubled_area = ab.cross(ac);
    const double slope = doubled_area.dot(normal);
    if (slope <= 0) continue;
    const double height = doubled_area.dot(a - point) / slope;
    if (std::abs(height) >= least_height) continue;
    const Vec3 offset = point + height * normal - a;
    const double v = offset.cross(ac).dot(doubled_area) / doubled_area.squaredNorm();
    const double w = ab.cross(offset).dot(doubled_area) / doubled_area.squaredNorm();
    constexpr double kTolerance = -1e-9;
    if (v < kTolerance || w < kTolerance || 1 - v - w < kTolerance) continue;
    least_height = std::abs(height);
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

/// Gram-Schmidt over the free nodes; true when the sample adds a new direction, which is then kept in `basis`.
bool adds_a_direction(const TetModel& model, const Footprint::Sample& sample, std::vector<SparseRow>& basis) {
  SparseRow row;
  for (int c = 0; c < 3; ++c)
    if (!model.is_fixed(sample.nodes[static_cast<size_t>(c)]))
      row[sample.nodes[static_cast<size_t>(c)]] += sample.barycentric[c];
  const double before = dot(row, row);
  if (before < 1e-12) return false;
  for (const SparseRow& direction : basis) {
    const double along = dot(row, direction);
    for (const auto& [node, weight] : direction) row[node] -= along * weight;
  }
  const double left = dot(row, row);
  if (left < kLeastIndependentPart * before) return false;
  for (auto& entry : row) entry.second /= std::sqrt(left);
  basis.push_back(row);
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

  const Vec3 tangent = footprint.normal.unitOrthogonal(), bitangent = footprint.normal.cross(tangent);
  std::vector<SparseRow> basis;
  for (const Eigen::Vector2d& q : disc_pattern()) {
    const Vec3 point = footprint.center_mm + radius_mm * (q[0] * tangent + q[1] * bitangent);
    const auto sample = sample_along(nodes, boundary, point, footprint.normal);
    if (sample && adds_a_direction(model, *sample, basis)) footprint.samples.push_back(*sample);
  }
  return footprint;
}

Eigen::SparseMatrix<double> constraint_matrix(const TetModel& model, const Footprint& footprint) {
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t s = 0; s < footprint.samples.size(); ++s)
    for (int c = 0; c < 3; ++c) {
      const int first = model.first_unknown(footprint.samples[s].nodes[static_cast<size_t>(c)]);
      if (first < 0) continue;
      for (int i = 0; i < 3; ++i)
        entries.emplace_back(3 * static_cast<int>(s) + i, first + i, footprint.samples[s].barycentric[c]);
    }
  Eigen::SparseMatrix<double> J(3 * static_cast<int>(footprint.samples.size()), model.unknown_count());
  J.setFromTriplets(entries.begin(), entries.end());
  return J;
}

}  // namespace palpate
