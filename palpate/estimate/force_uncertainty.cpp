#include "palpate/estimate/force_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "palpate/core/errors.h"
#include "palpate/estimate/map_model.h"

namespace palpate {

namespace {

/// Where the ensemble is pressed and pulled.
constexpr size_t kPlaces = 4;
/// Places lie within this ratio of the surface's reach around its middle.
constexpr double kWithin = 0.7;
/// Displacement at the places, over the radius of the patch.
constexpr double kDisplacement_radii = 0.5;
/// A law's deviation grows with the displacement up to so many times the one that was tried.
constexpr double kMaxLawRatio = 3;
constexpr double kMaxPoissonRatio = 0.495;

std::vector<Vec3> spread_places(const std::vector<Vec3>& surface_mm) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : surface_mm) middle += p / static_cast<double>(surface_mm.size());
  double reach_mm = 0;
  for (const Vec3& p : surface_mm) reach_mm = std::max(reach_mm, (p - middle).norm());
  std::vector<Vec3> inner;
  for (const Vec3& p : surface_mm)
    if ((p - middle).norm() <= kWithin * reach_mm) inner.push_back(p);
  if (inner.empty()) return {};
  const auto nearest = std::min_element(inner.begin(), inner.end(), [&](const Vec3& a, const Vec3& b) {
    return (a - middle).norm() < (b - middle).norm();
  });
  std::vector<Vec3> places = {*nearest};
  std::vector<double> distance_mm(inner.size(), std::numeric_limits<double>::infinity());
  while (places.size() < std::min(kPlaces, inner.size())) {
    for (size_t i = 0; i < inner.size(); ++i)
      distance_mm[i] = std::min(distance_mm[i], (inner[i] - places.back()).norm());
    places.push_back(
        inner[static_cast<size_t>(std::max_element(distance_mm.begin(), distance_mm.end()) - distance_mm.begin())]);
  }
  return places;
}

/// Force of a patch at a place, pressed in and pulled out by the same displacement; no value where there is no
/// equilibrium.
struct Pressed {
  Vec3 normal = Vec3::UnitZ();
  std::optional<double> in_N, out_N;
};

Pressed press(ContactModel& model, const Vec3& place_mm, double radius_mm, double displacement_mm) {
  model.begin(place_mm, radius_mm);
  Pressed pressed;
  pressed.normal = model.footprint(0).normal;
  const auto force_at = [&](double along_normal_mm) -> std::optional<double> {
    const Equilibrium equilibrium = model.solve({along_normal_mm * pressed.normal});
    if (!equilibrium.converged) return std::nullopt;
    return equilibrium.contacts.front().force_N.norm();
  };
  pressed.in_N = force_at(-displacement_mm);
  pressed.out_N = force_at(displacement_mm);
  model.end(0);
  return pressed;
}

/// Squared log ratio; nothing is added where one of them has no equilibrium.
double squared_log_ratio(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b || !(*a > 0) || !(*b > 0)) return 0;
  return std::pow(std::log(*a / *b), 2);
}

AttachmentOptions nearer_to_camera(AttachmentOptions attachments, double by_mm) {
  for (AttachmentRegion& region : attachments.regions) {
    region.depth_mm += by_mm;
    region.min_mm.z() -= by_mm;
    region.center_mm.z() -= by_mm;
  }
  return attachments;
}

TissueMap with_thickness(TissueMap map, const MapOptions& options, double thickness_mm) {
  map.mesh = tetrahedralize(close_body(map.surface, thickness_mm), options.elements);
  return map;
}

}  // namespace

void describe(Settings& settings, UncertaintyOptions& options) {
  settings.number("young_modulus_factor", options.young_modulus_factor, {1, 100},
                  "factor to which Young's modulus is known: 1.3 = within 30 % more or less");
  settings.number("poisson_ratio", options.poisson_ratio, {0, 0.3}, "of Poisson's ratio");
  settings.number("thickness_mm", options.thickness_mm, {0, 200}, "of map.thickness_mm");
  settings.number("attachments_mm", options.attachments_mm, {0, 100},
                  "of the depth, along the optical axis, to which the attachments reach");
  settings.choices("laws", options.laws, law_words(), "further laws that the tissue may follow");
}

double ForceUncertainty::log_deviation(const Vec3& at_rest_mm, const Vec3& q_mm) const {
  if (places.empty()) return modulus;
  const Place& place = *std::min_element(places.begin(), places.end(), [&](const Place& a, const Place& b) {
    return (a.at_rest_mm - at_rest_mm).norm() < (b.at_rest_mm - at_rest_mm).norm();
  });
  const bool presses = q_mm.dot(place.normal) < 0;
  const double law =
      (presses ? place.law_pressed : place.law_pulled) * std::min(q_mm.norm() / reference_mm, kMaxLawRatio);
  return std::hypot(modulus, presses ? place.pressed : place.pulled, law);
}

ForceUncertainty force_uncertainty(const TissueMap& map, const Rectification& rectification, const MapOptions& options,
                                   const UncertaintyOptions& uncertainty, double radius_mm) {
  ForceUncertainty result;
  result.modulus = std::log(uncertainty.young_modulus_factor);
  result.reference_mm = kDisplacement_radii * radius_mm;
  if (uncertainty.thickness_mm > 0 && !options.volume.empty())
    throw BadInput("uncertainty.thickness_mm varies map.thickness_mm, but map.volume says the body; leave it out");
  if (uncertainty.thickness_mm >= options.thickness_mm)
    throw BadInput("uncertainty.thickness_mm is as large as map.thickness_mm, expected less");

  struct Member {
    TissueMap map;
    bool is_law;
  };
  std::vector<Member> members;
  const auto add = [&](bool is_law) -> TissueMap& { return members.emplace_back(map, is_law).map; };
  if (uncertainty.poisson_ratio > 0) {
    TissueOptions& tissue = add(false).tissue;
    const double higher = tissue.poisson_ratio + uncertainty.poisson_ratio;
    tissue.poisson_ratio =
        higher <= kMaxPoissonRatio ? higher : std::max(0.0, tissue.poisson_ratio - uncertainty.poisson_ratio);
  }
  if (uncertainty.thickness_mm > 0)
    add(false) = with_thickness(map, options, options.thickness_mm + uncertainty.thickness_mm);
  if (uncertainty.attachments_mm > 0)
    add(false).attachments = nearer_to_camera(map.attachments, uncertainty.attachments_mm);
  for (const Law law : uncertainty.laws) add(true).tissue.law = law;
  if (members.empty()) return result;

  ContactModel base = contact_model(map, rectification, radius_mm);
  std::vector<Pressed> base_pressed;
  for (const Vec3& at_rest_mm : spread_places(map.surface.vertices_mm)) {
    base_pressed.push_back(press(base, at_rest_mm, radius_mm, result.reference_mm));
    result.places.push_back({at_rest_mm, base_pressed.back().normal});
  }
  const double laws = std::max<double>(1, static_cast<double>(uncertainty.laws.size()));
  for (const Member& member : members) {
    ContactModel changed = contact_model(member.map, rectification, radius_mm);
    for (size_t i = 0; i < result.places.size(); ++i) {
      ForceUncertainty::Place& place = result.places[i];
      const Pressed pressed = press(changed, place.at_rest_mm, radius_mm, result.reference_mm);
      const double in2 = squared_log_ratio(pressed.in_N, base_pressed[i].in_N),
                   out2 = squared_log_ratio(pressed.out_N, base_pressed[i].out_N);
      (member.is_law ? place.law_pressed : place.pressed) += member.is_law ? in2 / laws : in2;
      (member.is_law ? place.law_pulled : place.pulled) += member.is_law ? out2 / laws : out2;
    }
  }
  for (ForceUncertainty::Place& place : result.places)
    for (double* squared : {&place.pressed, &place.pulled, &place.law_pressed, &place.law_pulled})
      *squared = std::sqrt(*squared);
  return result;
}

ForceBand total_band(const ForceBand& from_images, double force_N, double log_deviation) {
  const double more = kBandQuantile * log_deviation;
  if (!(force_N > 0)) return {0, from_images.high_N * std::exp(more)};
  const auto factor = [more](double ratio) { return std::exp(std::hypot(std::log(ratio), more)); };
  const double low_N = from_images.low_N > 0 ? force_N / factor(force_N / from_images.low_N) : 0;
  return {low_N, force_N * factor(std::max(from_images.high_N, force_N) / force_N)};
}

}  // namespace palpate
