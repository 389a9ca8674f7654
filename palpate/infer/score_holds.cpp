#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "palpate/infer/filter_state.h"

namespace palpate {

double FilterState::log_free_tip(size_t instrument, const TipObservation& tip, const Belief& free,
                                 double seconds) const {
  if (!tip.visible) return 0;
  const Hand& hand = hands[instrument];
  const Vec3 tip_mm = free.scene(about_mm).undo(tip.tip_mm);
  const double step_mm = parameters.hand_mm_per_s * seconds;
  const Mat3 walk = step_mm * step_mm * Mat3::Identity() + tip_floor_covariance_mm2(tip, rectification, parameters);
  const Gap gap = gap_to_surface(tip_mm, rest_mm, rest_boundary);
  const double deviation_mm = std::hypot(parameters.gap_mm, std::sqrt(gap.normal.dot(tip.covariance_mm2 * gap.normal)));
  const double from_last =
      hand.last_tip_mm ? log_normal(tip_mm - *hand.last_tip_mm, walk) : -3 * std::log(parameters.free_space_mm);
  return from_last + log_normal_cdf(gap.distance_mm / deviation_mm);
}

double FilterState::force_per_mm(size_t contact) const {
  const auto k = 3 * static_cast<Eigen::Index>(contact);
  return std::cbrt(std::max(1e-12, body->response.force.block<3, 3>(k, k).determinant()));
}

ContactFit FilterState::fit_sliding(const Belief& prior, const FrameData& data, size_t contact) const {
  const Vec3 normal = model.footprint(contact).normal;
  const Mat3 along_surface = Mat3::Identity() - normal * normal.transpose();
  Belief sliding = prior;
  const auto walks = [&](Eigen::Index at, double mm_per_s) {
    const double step_mm = mm_per_s * data.seconds;
    sliding.covariance.block<3, 3>(at, at) += std::copysign(step_mm * step_mm, mm_per_s) * along_surface;
  };
  // It is the tip that walks at the speed of a hand; the tissue stays, as friction drags it, and so does the radius.
  walks(Unknowns::offset(contact), parameters.hand_mm_per_s);
  walks(Unknowns::q(contact), -parameters.hand_mm_per_s);
  walks(Unknowns::q(contact), parameters.resting_mm_per_s);
  const Eigen::Index radius = Unknowns::log_radius(contact);
  sliding.covariance(radius, radius) -= std::pow(parameters.log_radius_walk, 2) * data.seconds;
  const ForceAt at = force_at(*body, prior, contact);
  const double pressed_N = -at.force_N.dot(normal);
  const Vec3 tangential_N = at.force_N + pressed_N * normal;
  std::vector<Measurement> cone;
  if (pressed_N > 0 && tangential_N.norm() > 1e-9) {
    const Vec3 direction = tangential_N.normalized();
    Measurement m;
    m.residual.setConstant(1, options.friction * pressed_N - tangential_N.norm());
    m.H = (direction + options.friction * normal).transpose() * at.per_unknown;
    // Linearized at the prior's mean, used at the body's unknowns.
    m.residual += m.H * (prior.mean - body->unknowns(prior));
    // Friction is known to a factor, and a touch to a small force.
    const double deviation_N =
        parameters.friction_error * options.friction * pressed_N + parameters.touch_mm * force_per_mm(contact);
    m.covariance.setConstant(1, 1, deviation_N * deviation_N);
    m.dof = 1e3;
    cone.push_back(m);
  }
  ContactFit fit = fit_linear(sliding, data, *body, model, context(), cone);
  // The cone tells how likely a slip is, not how narrow it is.
  if (!cone.empty()) fit.log_evidence -= log_student_t(0, std::log(cone[0].covariance(0, 0)), 1, cone[0].dof);
  return fit;
}

ContactFit FilterState::free_of(const Belief& prior, const FrameData& data, size_t contact) {
  const SolvedBody without = without_force(*body, contact);
  // The tips' patches keep their numbers but for the one that is gone.
  const PredictedBody predicted{&without.response, &without.places, without.unknowns(prior), about_mm};
  std::vector<Measurement> rows = tissue_measurements(data.tissue, predicted, rectification, parameters);
  for (const ContactTip& tip : data.tips) {
    const size_t in_model = tip.contact + (tip.contact >= contact);
    rows.push_back(tip_measurement(tip.tip_mm, tip.covariance_mm2, tip.contact, model.footprint(in_model).center_mm,
                                   predicted, parameters));
  }
  const MapEstimate estimate = maximum_a_posteriori(prior, predicted.x0, rows);
  ContactFit fit;
  fit.posterior = fit.kept = estimate.posterior;
  fit.log_evidence = estimate.log_evidence;
  fit.chi2_ratio = estimate.dof > 0 ? estimate.chi2 / estimate.dof : 1;
  return fit;
}

bool FilterState::is_near_its_patch(const TipObservation& tip, const Belief& free, size_t contact) const {
  const Vec3 tip_mm = free.scene(about_mm).undo(tip.tip_mm);
  return (tip_mm - model.footprint(contact).center_mm).norm() < parameters.left_mm;
}

void FilterState::score_holds(size_t instrument, const Belief& prior, const FrameData& data, const TipObservation& tip,
                              ContactFit& tied) {
  Hand& hand = hands[instrument];
  const size_t k = *hand.contact;
  FrameData without = data;
  std::erase_if(without.tips, [k](const ContactTip& t) { return t.contact == k; });
  for (ContactTip& t : without.tips) t.contact -= t.contact > k;
  // Every hypothesis is scored with the same noise.
  const PredictedBody held{&body->response, &body->places, body->unknowns(tied.posterior), about_mm, &patches};
  for (TissuePoint& point : without.tissue) point.model_mm = model_error_mm(point, held, parameters);
  const Belief free_prior = without_contact(prior, k);
  const ContactFit free =
      model.contact_count() == 1 ? fit_at_rest(free_prior, without, context()) : free_of(free_prior, without, k);
  ByHold log_likelihood{};
  log_likelihood[static_cast<size_t>(Hold::free)] =
      free.log_evidence + log_free_tip(instrument, tip, free.posterior, data.seconds);
  // Jaws that are known to be closed on tissue are not free of it.
  if (tip.closed.value_or(false))
    log_likelihood[static_cast<size_t>(Hold::free)] = tied.log_evidence - parameters.told_log_odds;
  log_likelihood[static_cast<size_t>(Hold::grasp)] = tied.log_evidence;
  const ForceAt force = force_at(*body, tied.posterior, k);
  const Vec3 normal = model.footprint(k).normal;
  log_likelihood[static_cast<size_t>(Hold::push)] =
      tied.log_evidence + log_in_friction_cone(force.force_N, force_covariance(force, tied), normal, options.friction,
                                               parameters.friction_error);
  std::optional<ContactFit> sliding;
  if (hand.filter.allows(Hold::slide)) {
    sliding = fit_sliding(prior, data, k);
    log_likelihood[static_cast<size_t>(Hold::slide)] =
        sliding->log_evidence +
        std::min(0.0, log_normal_cdf(-force.force_N.dot(normal) / (0.05 * force.force_N.norm() + 1e-9)));
  }
  hand.filter.update(log_likelihood);
  if (hand.filter.probability(Hold::free) > 0.5 || tip.closed == false) {
    // Near its place the tip may still turn out to hold the tissue.
    if (hand.is_told || (tip.visible && tip.closed.value_or(true) && is_near_its_patch(tip, free.posterior, k))) {
      hand.free_scene = free.posterior.scene(about_mm);
      // What a contact that is more probably none says about its slow unknowns is not learned.
      forget(prior, Unknowns::offset(k), Unknowns::kContact - 3, belief);
      return;
    }
    release(instrument, free.kept);
    return;
  }
  hand.is_confirmed = true;
  const double deviation_N = std::sqrt(force_covariance(force, tied).trace() / 3);
  hand.is_felt |= force.force_N.norm() > parameters.telling_force * deviation_N;
  if (sliding && hand.filter.most_probable() == Hold::slide) tied = *sliding;
}

}  // namespace palpate
