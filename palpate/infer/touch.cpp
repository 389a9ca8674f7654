#include <algorithm>
#include <cmath>

#include "palpate/infer/filter_state.h"

namespace palpate {

namespace {

/// The body for a contact is made ready so many frames before the tip would be there, and not anew in less than that.
constexpr int kExpectedFrames = 4;

}  // namespace

Gap FilterState::gap_of(const Vec3& tip_in_map_mm) const {
  if (!body) return gap_to_surface(tip_in_map_mm, rest_mm, rest_boundary);
  std::vector<Vec3> nodes = model.model().rest_mm();
  for (size_t n = 0; n < nodes.size(); ++n)
    nodes[n] += body->response.equilibrium.u.segment<3>(3 * static_cast<Eigen::Index>(n));
  return gap_to_surface(tip_in_map_mm, nodes, model.boundary());
}

Vec3 FilterState::place_at_rest(const Gap& gap) const {
  const std::vector<Triangle>& triangles = body ? model.boundary() : rest_boundary;
  const std::vector<Vec3>& nodes = body ? model.model().rest_mm() : rest_mm;
  Vec3 place_mm = Vec3::Zero();
  for (size_t c = 0; c < 3; ++c)
    place_mm += gap.barycentric[static_cast<int>(c)] *
                nodes[static_cast<size_t>(triangles[static_cast<size_t>(gap.triangle)][c])];
  return place_mm;
}

ContactPrior FilterState::prior_of_touch() const {
  ContactPrior prior;
  prior.q_covariance_mm2 = parameters.touch_mm * parameters.touch_mm * Mat3::Identity();
  prior.offset_covariance_mm2 = parameters.offset_mm * parameters.offset_mm * Mat3::Identity();
  prior.log_radius = stated_log_radius();
  prior.skew_deviation = parameters.skew;
  prior.log_radius_deviation = options.drive == Drive::fused ? parameters.log_radius : 1e-3;
  return prior;
}

void FilterState::begin_at(size_t instrument, const Vec3& place_mm, const ContactPrior& prior) {
  Hand& hand = hands[instrument];
  model.begin(place_mm, options.footprint_radius_mm);
  hand.contact = model.contact_count() - 1;
  instrument_of_contact.push_back(instrument);
  hand.released_at_mm.reset();
  hand.is_felt = false;
  hand.passed.reset();
  hand.slid_from_mm.setZero();
  hand.onset_s = last_time_s;
  belief = with_contact(belief, prior);
  solve_anew();
}

void FilterState::begin_told(size_t instrument, const FrameEvidence& frame) {
  begin_at(instrument, *frame.held_at_mm, prior_of_touch());
  hands[instrument].is_told = true;
  hands[instrument].filter.touch(frame.held_for_sure ? 1 : parameters.held_untold);
  hands[instrument].free_scene = belief.scene(about_mm);
}

ContactPrior FilterState::prior_of_unnoticed_touch(const Vec3& q_mm) const {
  ContactPrior prior = prior_of_touch();
  prior.q_mm = q_mm;
  const double deviation_mm = parameters.touch_mm + 0.5 * q_mm.norm();
  prior.q_covariance_mm2 = deviation_mm * deviation_mm * Mat3::Identity();
  return prior;
}

void FilterState::begin(size_t instrument, const TipObservation& tip, const Vec3& place_mm, const ContactPrior& prior) {
  Hand& hand = hands[instrument];
  hand.tip_at_mark_mm = tip.tip_mm;
  begin_at(instrument, place_mm, prior);
  // Where the tip stands against the patch: the displacement of the first frame is known as the prior says.
  FrameData data;
  data.seconds = 0.04;
  data.tips.push_back({*hand.contact, tip.tip_mm, tip_floor_covariance_mm2(tip, rectification, parameters)});
  const ContactFit fit = fit_linear(belief, data, *body, model, context());
  belief = fit.kept;
  hand.slid_from_mm = belief.offset_mm(*hand.contact);
  hand.learned_at_mm = Vec3::Zero();
}

void FilterState::look_for_touch(size_t instrument, const FrameEvidence& frame, double seconds,
                                 InstrumentAnswer& answer) {
  Hand& hand = hands[instrument];
  const TipObservation& tip = frame.tips[instrument];
  const Vec3 tip_mm = belief.scene(about_mm).undo(tip.tip_mm);
  const Gap gap = gap_of(tip_mm);
  if (hand.released_at_mm &&
      ((tip_mm - *hand.released_at_mm).norm() > parameters.left_mm || gap.distance_mm > parameters.left_mm))
    hand.released_at_mm.reset();
  if (!hand.last_tip_mm) return;
  FreeTip free;
  free.gap_mm = gap.distance_mm;
  free.gap_deviation_mm = std::sqrt(gap.normal.dot(tip.covariance_mm2 * gap.normal));
  free.step_mm = tip_mm - *hand.last_tip_mm;
  free.step_covariance_mm2 = tip_floor_covariance_mm2(tip, rectification, parameters);
  const bool closes = tip.closed.value_or(false) && hand.was_closed == false;
  const double reach_mm = options.threshold_mm + std::min(2 * free.gap_deviation_mm, 0.5 * options.threshold_mm);
  if (free.gap_mm > reach_mm || tip.closed == false) {
    expect_touch(hand, gap, free.step_mm, tip_mm);
    look_back(instrument, frame, tip_mm, answer);
    return;
  }
  TouchEvidence evidence = touch_evidence(free, seconds, parameters);
  const double rate = 1 - std::exp(-parameters.touch_per_s * seconds);
  double log_odds = std::log(rate / (1 - rate)) + evidence.log_ratio;
  if (closes) log_odds = parameters.told_log_odds;
  const double probability = 1 / (1 + std::exp(-log_odds));
  remember_touch(hand, gap, tip_mm, log_odds);
  if (probability < 0.5 || (hand.released_at_mm && !evidence.unnoticed)) {
    if (probability < 0.5) expect_touch(hand, gap, free.step_mm, tip_mm);
    look_back(instrument, frame, tip_mm, answer);
    return;
  }
  answer.is_off_limits = frame.may_be_held && !frame.may_be_held(place_at_rest(gap));
  if (answer.is_off_limits) return;
  const bool unnoticed = evidence.unnoticed && !closes;
  begin(instrument, tip, place_at_rest(gap),
        unnoticed ? prior_of_unnoticed_touch(std::min(0.0, gap.distance_mm) * gap.normal) : prior_of_touch());
  hand.is_confirmed = !unnoticed;
  hand.filter.touch(unnoticed ? std::min(probability, parameters.unconfirmed) : probability);
  answer.begins = true;
}

void FilterState::remember_touch(Hand& hand, const Gap& gap, const Vec3& tip_mm, double log_odds) const {
  if (hand.passed && hand.passed->log_odds > log_odds && last_time_s - hand.passed->time_s < parameters.remembered_s)
    return;
  hand.passed = PassedTouch{place_at_rest(gap), tip_mm, log_odds, last_time_s};
}

void FilterState::look_back(size_t instrument, const FrameEvidence& frame, const Vec3& tip_mm,
                            InstrumentAnswer& answer) {
  Hand& hand = hands[instrument];
  if (!hand.passed || last_time_s - hand.passed->time_s > parameters.remembered_s ||
      last_time_s - hand.looked_back_s < parameters.look_back_s)
    return;
  const Vec3 place_mm = hand.passed->place_mm;
  std::vector<TissuePoint> tissue = usable(frame.tissue);
  const auto distance_mm = [&](const TissuePoint& point) { return (point.rest_mm - place_mm).norm(); };
  std::sort(tissue.begin(), tissue.end(),
            [&](const TissuePoint& x, const TissuePoint& y) { return distance_mm(x) < distance_mm(y); });
  size_t near = 0;
  const auto asked = static_cast<size_t>(parameters.look_back_points);
  while (near < std::min(asked, tissue.size()) &&
         distance_mm(tissue[near]) < parameters.look_back_radii * options.footprint_radius_mm)
    ++near;
  if (near < (asked + 1) / 2) return;
  const std::vector<PointMisfit> all = misfits(tissue, belief);
  const auto unexplained_ratio = [&all](size_t from, size_t to) {
    double unexplained = 0;
    for (size_t i = from; i < to; ++i) unexplained += !all[i].explained;
    return unexplained / std::max(1.0, static_cast<double>(to - from));
  };
  // Tissue that is misplaced everywhere is not moved by this tip.
  if (unexplained_ratio(0, near) - unexplained_ratio(near, all.size()) < parameters.look_back_ratio) return;
  hand.looked_back_s = last_time_s;
  if (frame.may_be_held && !frame.may_be_held(place_mm)) return;
  begin(instrument, frame.tips[instrument], place_mm, prior_of_unnoticed_touch(tip_mm - hand.passed->tip_mm));
  hand.is_confirmed = false;
  hand.filter.touch(parameters.unconfirmed);
  answer.begins = true;
}

void FilterState::expect_touch(Hand& hand, const Gap& gap, const Vec3& step_mm, const Vec3& tip_mm) {
  hand.frames_expected = std::max(0, hand.frames_expected - 1);
  const double closing_mm = -step_mm.dot(gap.normal), away_mm = std::max(0.0, gap.distance_mm - options.threshold_mm);
  if (hand.frames_expected > 0 || closing_mm <= 0 || away_mm > kExpectedFrames * closing_mm) return;
  hand.frames_expected = kExpectedFrames;
  model.expect(place_at_rest(gap_of(tip_mm + away_mm / closing_mm * step_mm)), options.footprint_radius_mm);
}

void FilterState::release(size_t instrument, const Belief& without) {
  Hand& hand = hands[instrument];
  const size_t contact = *hand.contact;
  // Where nothing was ever felt the tip has not let go of anything: it may be about to touch.
  if (hand.is_felt) hand.released_at_mm = hand.last_tip_mm;
  hand.contact.reset();
  hand.filter.release();
  model.end(contact);
  instrument_of_contact.erase(instrument_of_contact.begin() + static_cast<std::ptrdiff_t>(contact));
  for (Hand& other : hands)
    if (other.contact && *other.contact > contact) --*other.contact;
  belief = without;
  if (model.contact_count() == 0) {
    body.reset();
  } else {
    solve_anew();
  }
}

}  // namespace palpate
