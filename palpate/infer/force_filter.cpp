#include "palpate/infer/force_filter.h"

#include <algorithm>
#include <cmath>

#include "palpate/infer/filter_state.h"

namespace palpate {

static_assert(Unknowns::kScene + kMaxInstruments * Unknowns::kContact <= kMaxUnknowns);

ForceFilter::ForceFilter(ContactModel model, const AttachedMesh& map, std::vector<TissuePoint> points,
                         const Rectification& rectification, const ContactOptions& contact,
                         const InferenceParameters& parameters)
    : state_(std::make_unique<FilterState>(std::move(model), map, std::move(points), rectification, contact,
                                           parameters)) {}
ForceFilter::~ForceFilter() = default;
ForceFilter::ForceFilter(ForceFilter&&) noexcept = default;

const ContactModel& ForceFilter::model() const {
  if (state_->ahead.valid()) state_->ahead.wait();
  return state_->model;
}

void ForceFilter::look_ahead() {
  state_->ahead = std::async(std::launch::async, [s = state_.get()] { s->look_ahead(); });
}

std::vector<TissuePoint> ForceFilter::wanted_points() {
  FilterState& s = *state_;
  s.finish_look_ahead();
  std::vector<char> is_wanted(s.points.size(), 0);
  for (size_t i : s.even_points) is_wanted[i] = 1;
  for (size_t k = 0; k < s.model.contact_count(); ++k) {
    const double excluded_mm = s.excluded_mm(k);
    std::vector<std::pair<double, size_t>> around;
    for (size_t i = 0; i < s.points.size(); ++i)
      if (const double distance_mm = (s.points[i].rest_mm - s.model.footprint(k).center_mm).norm();
          distance_mm > excluded_mm)
        around.emplace_back(distance_mm, i);
    const auto last = around.begin() + static_cast<std::ptrdiff_t>(
                                           std::min(static_cast<size_t>(s.parameters.near_points), around.size()));
    std::partial_sort(around.begin(), last, around.end());
    for (auto it = around.begin(); it != last; ++it) is_wanted[it->second] = 1;
  }
  std::vector<TissuePoint> wanted;
  for (size_t i = 0; i < s.points.size(); ++i)
    if (is_wanted[i]) wanted.push_back(s.points[i]);
  PredictedBody predicted{nullptr, nullptr, s.belief.mean, s.about_mm};
  if (s.body) predicted = {&s.body->response, &s.body->places, s.body->unknowns(s.belief), s.about_mm};
  const std::vector<Vec3> expected_px = palpate::expected_motion_px(wanted, predicted, s.rectification);
  for (size_t i = 0; i < wanted.size(); ++i) wanted[i].motion_px = expected_px[i];
  return wanted;
}

FrameAnswer ForceFilter::update(const FrameEvidence& frame) {
  FilterState& s = *state_;
  s.finish_look_ahead();
  s.has_looked_ahead = false;
  FrameAnswer answer;
  const double seconds = s.begun ? std::clamp(frame.time_s - s.last_time_s, 1e-3, 1.0) : 0.04;
  s.begun = true;
  s.last_time_s = frame.time_s;
  const Belief prior = predict(s.belief, seconds, s.parameters);
  for (Hand& hand : s.hands)
    if (hand.contact) hand.filter.predict(seconds, s.parameters);

  s.patches = s.reaches();
  FrameData data;
  data.tissue = s.usable(frame.tissue);
  data.seconds = seconds;
  for (const Hand& hand : s.hands)
    if (hand.contact)
      if (const auto tip = s.contact_tip(hand, frame.tips[static_cast<size_t>(&hand - s.hands.data())]))
        data.tips.push_back(*tip);
  for (const ContactTip& tip : data.tips) {
    s.patches[tip.contact].tip_mm = tip.tip_mm;
    s.patches[tip.contact].tip_offset_mm = prior.offset_mm(tip.contact);
  }

  ContactFit fit =
      s.body ? fit_contacts(prior, data, *s.body, s.model, s.context()) : fit_at_rest(prior, data, s.context());
  s.belief = fit.kept;
  if (s.body && fit.converged) {
    const std::vector<size_t> touching = s.instrument_of_contact;
    for (size_t instrument : touching) {
      s.score_holds(instrument, prior, data, frame.tips[instrument], fit);
      if (!s.hands[instrument].contact) break;  // the others are scored again in the next frame
      if (s.hands[instrument].filter.most_probable() == Hold::slide) s.belief = fit.kept;
    }
  }
  // A touch that nobody saw and that has no equilibrium was a wrong tip's.
  for (size_t instrument : std::vector<size_t>(s.instrument_of_contact)) {
    if (fit.converged || s.hands[instrument].is_confirmed) continue;
    s.release(instrument, without_contact(s.belief, *s.hands[instrument].contact));
  }
  bool explained = true;
  const double misfit_mm = s.misfit_mm(data, s.belief, explained);
  answer.explained = explained;
  answer.scene = s.belief.scene(s.about_mm);
  if (s.belief.mean.size() != fit.posterior.mean.size()) {
    // A contact has ended: what is left is answered as it is believed now.
    fit.posterior = fit.kept = s.belief;
    fit.converged = true;
  }
  for (size_t i = 0; i < s.hands.size(); ++i) {
    InstrumentAnswer& of = answer.instruments[i];
    const TipObservation& tip = frame.tips[i];
    of.tip_mm = tip.tip_mm;
    if (s.hands[i].contact && s.hands[i].filter.most_probable() != Hold::free) {
      s.report(i, fit, tip, of);
      of.misfit_mm = misfit_mm;
    } else if (s.hands[i].contact) {
      of.p_contact = s.hands[i].filter.p_contact();
      answer.scene = s.hands[i].free_scene;
    }
  }
  const bool any_touches = std::any_of(s.hands.begin(), s.hands.end(), [](const Hand& hand) {
    return hand.contact && hand.filter.most_probable() != Hold::free;
  });
  if (s.body && any_touches) answer.equilibrium = s.body->response.equilibrium;
  if (fit.converged && s.body) s.renewal = Renewal{prior, data, fit, s.instrument_of_contact};
  for (size_t i = 0; i < s.hands.size(); ++i) {
    const TipObservation& tip = frame.tips[i];
    Hand& hand = s.hands[i];
    if (!tip.visible) {
      hand.last_tip_mm.reset();
      if (i == 0 && !hand.contact && frame.held_at_mm) s.begin_told(i, frame);
      continue;
    }
    if (!hand.contact && frame.may_touch) {
      s.look_for_touch(i, frame, seconds, answer.instruments[i]);
      if (hand.contact && hand.filter.most_probable() != Hold::free) {
        fit.posterior = fit.kept = s.belief;
        fit.converged = s.body->response.equilibrium.converged;
        s.report(i, fit, tip, answer.instruments[i]);
        answer.equilibrium = s.body->response.equilibrium;
      }
    }
    hand.last_tip_mm = answer.scene.undo(tip.tip_mm);
    if (tip.closed) hand.was_closed = tip.closed;
  }
  for (size_t i = 0; i < s.hands.size(); ++i) answer.instruments[i].is_kept = s.hands[i].contact.has_value();
  return answer;
}

}  // namespace palpate
