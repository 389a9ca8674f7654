#include "palpate/infer/filter_state.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// So many of the points, each as far as possible from those before it.
std::vector<size_t> spread_evenly(const std::vector<TissuePoint>& points, size_t count) {
  std::vector<double> distance_mm(points.size(), INFINITY);
  std::vector<size_t> chosen;
  size_t next = 0;
  while (chosen.size() < std::min(count, points.size())) {
    chosen.push_back(next);
    for (size_t i = 0; i < points.size(); ++i)
      distance_mm[i] = std::min(distance_mm[i], (points[i].rest_mm - points[next].rest_mm).norm());
    next = static_cast<size_t>(std::max_element(distance_mm.begin(), distance_mm.end()) - distance_mm.begin());
  }
  return chosen;
}

}  // namespace

FilterState::FilterState(ContactModel m, const AttachedMesh& map, std::vector<TissuePoint> p, const Rectification& r,
                         const ContactOptions& o, const InferenceParameters& q)
    : model(std::move(m)), rectification(r), options(o), parameters(q), points(std::move(p)) {
  rest_mm = map.mesh.nodes_mm;
  rest_boundary = boundary_triangles(map.mesh);
  rest_places = places_of(points, rest_mm, rest_boundary);
  Vec3 sum = Vec3::Zero();
  for (const TissuePoint& point : points) sum += point.rest_mm;
  about_mm = points.empty() ? rest_mm.front() : Vec3(sum / static_cast<double>(points.size()));
  even_points = spread_evenly(points, static_cast<size_t>(parameters.even_points));
  if (options.drive == Drive::tip) parameters.log_radius_walk = 0;  // the radius is the one stated
  belief = initial_belief(parameters);
  for (size_t i = 0; i < kMaxInstruments; ++i) hands.emplace_back(options.grip);
}

FitContext FilterState::context() const {
  const bool settles = std::any_of(hands.begin(), hands.end(), [this](const Hand& hand) {
    return hand.contact && last_time_s - hand.onset_s < parameters.settling_s;
  });
  return {rectification, parameters, about_mm, options.drive == Drive::fused || settles, stated_log_radius(), patches};
}

double FilterState::stated_log_radius() const {
  return std::log(options.footprint_radius_mm);
}

std::vector<PatchReach> FilterState::reaches() const {
  std::vector<PatchReach> result;
  for (size_t k = 0; k < model.contact_count(); ++k)
    result.push_back({model.footprint(k).center_mm, model.radius_mm(k)});
  return result;
}

double FilterState::excluded_mm(size_t contact) const {
  return parameters.excluded_radii * model.radius_mm(contact);
}

std::vector<TissuePoint> FilterState::usable(const std::vector<TissuePoint>& seen) const {
  std::vector<TissuePoint> used;
  for (const TissuePoint& point : seen) {
    bool take = rest_places[static_cast<size_t>(point.number)].on_body;
    for (size_t k = 0; k < model.contact_count() && take; ++k)
      take = (point.rest_mm - model.footprint(k).center_mm).norm() > excluded_mm(k);
    if (take) used.push_back(point);
  }
  return used;
}

void FilterState::solve_anew() {
  SolvedBody fresh;
  for (size_t k = 0; k < model.contact_count(); ++k) {
    fresh.q_mm.push_back(belief.q_mm(k));
    fresh.log_radius.push_back(std::log(model.radius_mm(k)));
  }
  const Equilibrium equilibrium = model.solve(fresh.q_mm);
  fresh.response = model.respond(equilibrium, fresh.q_mm);
  fresh.places = places_of(points, model.model().rest_mm(), model.boundary());
  body = std::move(fresh);
}

Mat3 FilterState::force_covariance(const ForceAt& at, const ContactFit& fit) const {
  const Mat3 from_images =
      std::max(1.0, fit.chi2_ratio) * at.per_unknown * fit.posterior.covariance * at.per_unknown.transpose();
  const double model_N = parameters.model_error * at.force_N.norm();
  return from_images + model_N * model_N * Mat3::Identity();
}

std::optional<ContactTip> FilterState::contact_tip(const Hand& hand, const TipObservation& tip) const {
  if (!tip.visible) return std::nullopt;
  const Mat3 floor_mm2 = tip_floor_covariance_mm2(tip, rectification, parameters);
  if (tip.since_mark_mm)
    return ContactTip{*hand.contact, hand.tip_at_mark_mm + *tip.since_mark_mm,
                      tip.since_mark_covariance_mm2 + floor_mm2};
  return ContactTip{*hand.contact, tip.tip_mm,
                    tip.covariance_mm2 + floor_mm2 + parameters.gap_mm * parameters.gap_mm * Mat3::Identity()};
}

}  // namespace palpate
