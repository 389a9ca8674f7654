#include <algorithm>
#include <cmath>

#include "palpate/infer/filter_state.h"

namespace palpate {

void FilterState::follow_slide(size_t instrument) {
  Hand& hand = hands[instrument];
  const size_t k = *hand.contact;
  const Vec3 normal = model.footprint(k).normal;
  Vec3 slid_mm = belief.offset_mm(k) - hand.slid_from_mm;
  slid_mm -= slid_mm.dot(normal) * normal;
  if (slid_mm.norm() <= parameters.slide_reach_radii * model.radius_mm(k)) return;
  const Vec3 from_mm = model.footprint(k).center_mm;
  model.move(k, from_mm + slid_mm);
  belief.mean.segment<3>(Unknowns::offset(k)) -= model.footprint(k).center_mm - from_mm;
  hand.slid_from_mm = belief.offset_mm(k);
  solve_anew();
}

void FilterState::lay_anew(size_t contact, double log_radius, const Belief& prior, const FrameData& data,
                           double log_evidence) {
  const double laid = std::log(model.radius_mm(contact));
  for (double step : {1.0, 0.5, 0.25}) {
    const std::optional<Equilibrium> equilibrium =
        model.set_radius(contact, std::exp(laid + step * (log_radius - laid)), body->q_mm);
    if (!equilibrium) continue;
    SolvedBody tried = *body;
    tried.response = model.respond(*equilibrium, body->q_mm);
    tried.log_radius[contact] = std::log(model.radius_mm(contact));
    const ContactFit again = fit_contacts(prior, data, tried, model, context());
    if (!again.converged || again.log_evidence < log_evidence - parameters.as_good) continue;
    body = std::move(tried);
    return;
  }
  if (const std::optional<Equilibrium> equilibrium = model.set_radius(contact, std::exp(laid), body->q_mm)) {
    body->response = model.respond(*equilibrium, body->q_mm);
  } else {
    solve_anew();
  }
}

void FilterState::renew_patch(size_t instrument, const Belief& prior, const FrameData& data, const ContactFit& fit) {
  const HoldFilter& filter = hands[instrument].filter;
  const size_t k = *hands[instrument].contact;
  const ForceAt force = force_at(*body, fit.posterior, k);
  const double deviation_N = std::sqrt(force_covariance(force, fit).trace() / 3);
  const bool tells_radius = force.force_N.norm() >= parameters.telling_force * deviation_N &&
                            filter.probability(Hold::slide) <= parameters.may_slide;
  if (!tells_radius) {
    forget(prior, Unknowns::log_radius(k), 1, belief);
    if (filter.most_probable() == Hold::slide) follow_slide(instrument);
    return;
  }
  // Laid as the tissue says, without the operator's word; what it says of the slow unknowns is heard when it is
  // linearized around what it says (iterated Kalman filter).
  const auto allowed = [this](double log_radius) {
    return std::clamp(log_radius, stated_log_radius() + std::log(parameters.min_radius_ratio),
                      stated_log_radius() + std::log(parameters.max_radius_ratio));
  };
  const double log_radius = allowed(fit.kept.mean[Unknowns::log_radius(k)]);
  Hand& hand = hands[instrument];
  const Eigen::Index at = Unknowns::log_radius(k);
  const bool is_told = fit.kept.covariance(at, at) < std::pow(parameters.log_radius / 2, 2);
  if (is_told && std::abs(log_radius - std::log(model.radius_mm(k))) > parameters.radius_change &&
      hand.laid_anew < parameters.laid_anew) {
    forget(prior, Unknowns::offset(k), Unknowns::kContact - 3, belief);
    ++hand.laid_anew;
    lay_anew(k, log_radius, prior, data, fit.log_evidence);
    return;
  }
  hand.laid_anew = 0;
  // Frames in which the patch stands where it stood share the model's error: they say the same, not more.
  const Vec3 q_mm = fit.posterior.q_mm(k);
  if ((q_mm - hand.learned_at_mm).norm() < parameters.new_pose * std::max(q_mm.norm(), hand.learned_at_mm.norm())) {
    forget(prior, Unknowns::offset(k), Unknowns::kContact - 3, belief);
    return;
  }
  double& learned = belief.mean[Unknowns::log_radius(k)];
  learned = allowed(learned);
  hand.learned_at_mm = q_mm;
}

void FilterState::look_ahead() {
  has_looked_ahead = true;
  const bool is_current = renewal && renewal->prior.mean.size() == belief.mean.size();
  for (size_t i = 0; is_current && i < renewal->instruments.size(); ++i)
    renew_patch(renewal->instruments[i], renewal->prior, renewal->data, renewal->fit);
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
