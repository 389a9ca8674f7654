#include <algorithm>
#include <cmath>

#include "palpate/infer/filter_state.h"

namespace palpate {

namespace {

/// A patch whose radius has changed by this ratio is laid anew.
constexpr double kRadiusChange = 0.08;
/// Probability of a slide from which on the radius is kept.
constexpr double kMaySlide = 0.05;
/// A slid patch is laid anew when it stands so many radii from its place.
constexpr double kSlideReach_radii = 0.4;

}  // namespace

void FilterState::follow_slide(size_t instrument) {
  Hand& hand = hands[instrument];
  const size_t k = *hand.contact;
  const Vec3 normal = model.footprint(k).normal;
  Vec3 slid_mm = belief.offset_mm(k) - hand.slid_from_mm;
  slid_mm -= slid_mm.dot(normal) * normal;
  if (slid_mm.norm() <= kSlideReach_radii * model.radius_mm(k)) return;
  const Vec3 from_mm = model.footprint(k).center_mm;
  model.move(k, from_mm + slid_mm);
  belief.mean.segment<3>(Unknowns::offset(k)) -= model.footprint(k).center_mm - from_mm;
  hand.slid_from_mm = belief.offset_mm(k);
  solve_anew();
}

void FilterState::renew_patch(size_t instrument, const Belief& prior, const ContactFit& fit) {
  const HoldFilter& filter = hands[instrument].filter;
  const size_t k = *hands[instrument].contact;
  const ForceAt force = force_at(*body, fit.posterior, k);
  const double deviation_N = std::sqrt(force_covariance(force, fit).trace() / 3);
  const bool tells_radius =
      force.force_N.norm() >= parameters.telling_force * deviation_N && filter.probability(Hold::slide) <= kMaySlide;
  if (!tells_radius) {
    forget(prior, Unknowns::log_radius(k), 1, belief);
    if (filter.most_probable() == Hold::slide) follow_slide(instrument);
    return;
  }
  // Frames in which the patch stands where it stood share the model's error: they say the same, not more.
  const Vec3 q_mm = fit.posterior.q_mm(k);
  Vec3& learned_at_mm = hands[instrument].learned_at_mm;
  if ((q_mm - learned_at_mm).norm() < parameters.new_pose * std::max(q_mm.norm(), learned_at_mm.norm())) {
    forget(prior, Unknowns::offset(k), Unknowns::kContact - 3, belief);
    return;
  }
  learned_at_mm = q_mm;
  // Laid as the tissue says, without the operator's word, so that what the tissue says next is right to first order.
  double& log_radius = belief.mean[Unknowns::log_radius(k)];
  log_radius = std::clamp(log_radius, stated_log_radius() + std::log(parameters.min_radius_ratio),
                          stated_log_radius() + std::log(parameters.max_radius_ratio));
  if (std::abs(log_radius - std::log(model.radius_mm(k))) > kRadiusChange) {
    const std::optional<Equilibrium> equilibrium = model.set_radius(k, std::exp(log_radius), body->q_mm);
    if (!equilibrium) return;
    body->response = model.respond(*equilibrium, body->q_mm);
    body->log_radius[k] = std::log(model.radius_mm(k));
  }
}

void FilterState::look_ahead() {
  has_looked_ahead = true;
  const bool is_current = renewal && renewal->prior.mean.size() == belief.mean.size();
  for (size_t i = 0; is_current && i < renewal->instruments.size(); ++i)
    renew_patch(renewal->instruments[i], renewal->prior, renewal->fit);
  renewal.reset();
  if (body) model.refresh();
}

void FilterState::finish_look_ahead() {
  if (ahead.valid()) {
    ahead.get();
  } else if (!has_looked_ahead) {
    look_ahead();
  }
}

}  // namespace palpate
