#include "palpate/simulate/pushed_tissue.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

const int kMaxSlips = 30;            // corrections of one move
const double kConeTolerance = 1e-3;  // of the coefficient of friction
const double kMinSlip_mm = 1e-4;
const double kSamplesPerEdge = 0.8;  // sparser than the nodes, so that no two samples say the same
const double kGrowthPerEdge = 0.4;   // by so much of an edge tied samples act as a larger disc (see make_footprint)
const double kJustTouching_mm = 1e-9;

const Vec3& at(const std::vector<Vec3>& values, int i) {
  return values[static_cast<size_t>(i)];
}

// Where a line along the normal meets the outer side of the surface, nearest to the point.
std::optional<Footprint::Sample> sample_along(const TruthBody& body, const Vec3& point, const Vec3& normal) {
  std::optional<Footprint::Sample> nearest;
  double min = std::numeric_limits<double>::infinity();
  for (const Triangle& t : body.boundary) {
    const Vec3& a = at(body.mesh.nodes_mm, t[0]);
    const Vec3 ab = at(body.mesh.nodes_mm, t[1]) - a, ac = at(body.mesh.nodes_mm, t[2]) - a;
    const Vec3 area = ab.cross(ac);
    const double slope = area.dot(normal);
    if (slope <= 0) continue;
    const double height = area.dot(a - point) / slope;
    if (std::abs(height) >= min) continue;
    const Vec3 offset = point + height * normal - a;
    const double v = offset.cross(ac).dot(area) / area.squaredNorm();
    const double w = ab.cross(offset).dot(area) / area.squaredNorm();
    if (v < -1e-9 || w < -1e-9 || v + w > 1 + 1e-9) continue;
    min = std::abs(height);
    nearest = Footprint::Sample{t, Vec3(1 - v - w, v, w)};
  }
  return nearest;
}

Vec3 mixed(const std::vector<Vec3>& values, const Footprint::Sample& sample) {
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 3; ++k) sum += sample.barycentric[k] * at(values, sample.nodes[static_cast<size_t>(k)]);
  return sum;
}

}  // namespace

PushedTissue::PushedTissue(const TetModel& model, const TruthBody& body, const TouchPoint& touch, double friction,
                           const EquilibriumOptions& precision)
    : model_(model),
      body_(body),
      touch_(touch),
      friction_(friction),
      normals_(vertex_normals(body.mesh.nodes_mm, body.boundary)),
      solver_(model, precision) {
  const double patch_mm2 = std::numbers::pi * body.patches[0].radius_mm * body.patches[0].radius_mm;
  spacing_mm_ = std::sqrt(patch_mm2 / static_cast<double>(body.patches[0].footprint.samples.size())) / kSamplesPerEdge;
}

Footprint PushedTissue::disc_at(const Eigen::Vector2d& place_mm) const {
  const Vec3 normal = touch_.axes.col(0);
  const auto sample_at = [&](const Eigen::Vector2d& p) {
    return sample_along(body_, touch_.point_mm + p[0] * touch_.axes.col(1) + p[1] * touch_.axes.col(2), normal);
  };
  const auto middle = sample_at(place_mm);
  if (!middle) throw BadInput("simulate.gesture: the instrument slides off the organ; move it less");
  Footprint disc;
  disc.samples.push_back(*middle);
  const double radius_mm = body_.patches[0].radius_mm - kGrowthPerEdge * kSamplesPerEdge * spacing_mm_;
  const int rings = static_cast<int>(radius_mm / spacing_mm_);
  if (rings < 1)
    throw BadInput(
        fmt::format("simulate.gesture: a push with a patch of {:.1f} mm is a point load on the true body's elements; "
                    "give a larger footprint_radius_mm or more simulate.body.elements",
                    body_.patches[0].radius_mm));
  for (int ring = 1; ring <= rings; ++ring)
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6 * ring);
      const auto sample =
          sample_at(place_mm + radius_mm * ring / rings * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
      if (sample) disc.samples.push_back(*sample);
    }
  disc.center_mm = mixed(body_.mesh.nodes_mm, *middle);
  disc.normal = Vec3::Zero();
  for (const Footprint::Sample& sample : disc.samples) {
    disc.normal += mixed(normals_, sample);
    for (const int node : sample.nodes)
      if (model_.is_fixed(node)) throw BadInput("simulate.gesture: the instrument slides onto attached tissue");
  }
  disc.normal.normalize();
  return disc;
}

void PushedTissue::hold(const Eigen::Vector2d& place_mm) {
  place_mm_ = place_mm;
  disc_ = disc_at(place_mm);
  solver_.hold(disc_);
  touching_ = true;
}

void PushedTissue::leave() {
  if (touching_) solver_.release();
  touching_ = false;
}

PushedTissue::Answer PushedTissue::move(const Vec3& displacement_mm) {
  const Vec3 normal = touch_.axes.col(0);
  const Vec3 tip_mm = touch_.point_mm + displacement_mm;
  const auto along_tangents = [&](const Vec3& v) {
    return Eigen::Vector2d(v.dot(touch_.axes.col(1)), v.dot(touch_.axes.col(2)));
  };
  const auto beneath = sample_along(body_, tip_mm, normal);
  Answer answer;
  if (!beneath || (tip_mm - mixed(body_.mesh.nodes_mm, *beneath)).dot(normal) > kJustTouching_mm) {
    leave();
    return answer;
  }
  if (!touching_) hold(along_tangents(displacement_mm));
  for (int correction = 0; correction < kMaxSlips; ++correction) {
    const Vec3 p_mm = tip_mm - disc_.center_mm;
    answer.equilibrium = solver_.solve(p_mm);
    if (!answer.equilibrium.converged) break;
    const Vec3& force_N = answer.equilibrium.force_N;
    const double normal_N = -force_N.dot(disc_.normal);
    const double tangential_N = (force_N + normal_N * disc_.normal).norm();
    if (normal_N < 0) {
      leave();
      return {};
    }
    const double beyond = tangential_N / std::max(normal_N, 1e-12) - friction_;
    if (answer.slid ? std::abs(beyond) < kConeTolerance : beyond < kConeTolerance) break;
    const Eigen::Vector2d slip_mm = (1 - friction_ * normal_N / tangential_N) * along_tangents(p_mm);
    if (slip_mm.norm() < kMinSlip_mm) break;
    answer.slid = true;
    hold(place_mm_ + slip_mm);
  }
  answer.touching = true;
  return answer;
}

}  // namespace palpate
