#include "palpate/infer/force_filter.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "palpate/contact/detect.h"
#include "palpate/infer/contact_fit.h"

namespace palpate {

namespace {

/// A patch whose radius has changed by this ratio is laid anew.
constexpr double kRadiusChange = 0.08;
/// A slid patch is laid anew when it stands so many radii from its place.
constexpr double kSlideReach_radii = 0.4;
/// A tip that let go touches again only after it was so far from the place, or from the surface.
constexpr double kLeft_mm = 2;
/// Squared distance of a tissue point from its prediction beyond which it is not explained.
constexpr double kUnexplained2 = 36;
constexpr double kUnexplainedFraction = 0.6;

/// After onset, the tip's place against the patch is not settled yet for so long.
constexpr double kSettling_s = 0.15;
/// Points followed evenly over the organ, and around each contact.
constexpr size_t kEvenPoints = 110, kNearPoints = 90;

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

double log_normal3(const Vec3& x, const Mat3& covariance) {
  return -0.5 *
         (x.dot(covariance.llt().solve(x)) + std::log(covariance.determinant()) + 3 * std::log(2 * std::numbers::pi));
}

/// log ratio of what is told, not seen.
constexpr double kSure = 10;
/// A tip inside the body may be a wrong one: the next frame's tissue has to confirm that it holds.
constexpr double kUnconfirmed = 0.4;
/// A place that the operator names is held with this probability, until the tissue says so.
constexpr double kHeldUntold = 0.02;

/// What is kept of one instrument.
struct Hand {
  explicit Hand(Grip grip) : filter(grip) {}
  HoldFilter filter;
  std::optional<size_t> contact;       ///< its number in the model
  Vec3 tip_at_mark_mm = Vec3::Zero();  ///< left camera frame
  std::optional<Vec3> last_tip_mm;     ///< in the map frame
  std::optional<Vec3> released_at_mm;  ///< in the map frame, until it has left
  std::optional<bool> was_closed;
  bool is_told = false;  ///< the operator says where it holds; there is no tip
  double onset_s = 0;
  SceneMotion free_scene;            ///< while a contact is kept that is more probably none
  Vec3 slid_from_mm = Vec3::Zero();  ///< the offset with which the patch was laid
};

}  // namespace

struct ForceFilter::State {
  ContactModel model;
  Rectification rectification;
  ContactOptions options;
  InferenceParameters parameters;
  std::vector<TissuePoint> points;
  Vec3 about_mm = Vec3::Zero();
  std::vector<Vec3> rest_mm;
  std::vector<Triangle> rest_boundary;
  std::vector<SurfacePlace> rest_places;
  std::vector<size_t> even_points;

  Belief belief;
  double last_time_s = 0;
  bool begun = false;
  std::vector<Hand> hands;
  std::vector<size_t> instrument_of_contact;
  std::optional<SolvedBody> body;
  std::vector<PatchReach> patches;  ///< as believed before the frame

  State(ContactModel m, const AttachedMesh& map, std::vector<TissuePoint> p, const Rectification& r,
        const ContactOptions& o, const InferenceParameters& q)
      : model(std::move(m)), rectification(r), options(o), parameters(q), points(std::move(p)) {
    rest_mm = map.mesh.nodes_mm;
    rest_boundary = boundary_triangles(map.mesh);
    rest_places = places_of(points, rest_mm, rest_boundary);
    Vec3 sum = Vec3::Zero();
    for (const TissuePoint& point : points) sum += point.rest_mm;
    about_mm = points.empty() ? rest_mm.front() : Vec3(sum / static_cast<double>(points.size()));
    even_points = spread_evenly(points, kEvenPoints);
    if (options.drive == Drive::tip) parameters.log_radius_walk = 0;  // the radius is the one stated
    belief = initial_belief(parameters);
    for (size_t i = 0; i < kMostInstruments; ++i) hands.emplace_back(options.grip);
  }

  /// Where the tip stands against the patch is told by the tissue that rests as yet, whatever drives later.
  FitContext context() const {
    const bool settles = std::any_of(hands.begin(), hands.end(), [this](const Hand& hand) {
      return hand.contact && last_time_s - hand.onset_s < kSettling_s;
    });
    return {rectification,       parameters, about_mm, options.drive == Drive::fused || settles,
            stated_log_radius(), patches};
  }

  double stated_log_radius() const { return std::log(options.footprint_radius_mm); }

  /// Where the model is believed to be right, as of `prior`.
  std::vector<PatchReach> reaches(const Belief& prior) const {
    std::vector<PatchReach> result;
    for (size_t k = 0; k < model.contact_count(); ++k) {
      const Eigen::Index at = Unknowns::log_radius(k);
      const double deviation = std::min(parameters.log_radius, std::sqrt(prior.covariance(at, at)));
      result.push_back({model.footprint(k).center_mm, std::exp(std::log(model.radius_mm(k)) - deviation),
                        model.distance_to_attachments_mm(k)});
    }
    return result;
  }

  /// Tissue nearer to a patch than this moves with it, whatever the model says.
  double excluded_mm(size_t contact) const {
    return parameters.excluded_radii * (contact < patches.size() ? patches[contact].rim_mm : model.radius_mm(contact));
  }

  /// The points on the body that no patch's rim disturbs; the same for every hypothesis of the frame.
  std::vector<TissuePoint> usable(const std::vector<TissuePoint>& seen) const {
    std::vector<TissuePoint> used;
    for (const TissuePoint& point : seen) {
      bool take = rest_places[static_cast<size_t>(point.number)].on_body;
      for (size_t k = 0; k < model.contact_count() && take; ++k)
        take = (point.rest_mm - model.footprint(k).center_mm).norm() > excluded_mm(k);
      if (take) used.push_back(point);
    }
    return used;
  }

  /// The body under its contacts, at rest: after the mesh has changed.
  void solve_anew() {
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

  Gap gap_of(const Vec3& tip_in_map_mm) const {
    if (!body) return gap_to_surface(tip_in_map_mm, rest_mm, rest_boundary);
    std::vector<Vec3> nodes = model.model().rest_mm();
    for (size_t n = 0; n < nodes.size(); ++n)
      nodes[n] += body->response.equilibrium.u.segment<3>(3 * static_cast<Eigen::Index>(n));
    return gap_to_surface(tip_in_map_mm, nodes, model.boundary());
  }

  Vec3 place_at_rest(const Gap& gap) const {
    const std::vector<Triangle>& triangles = body ? model.boundary() : rest_boundary;
    const std::vector<Vec3>& nodes = body ? model.model().rest_mm() : rest_mm;
    Vec3 place_mm = Vec3::Zero();
    for (size_t c = 0; c < 3; ++c)
      place_mm += gap.barycentric[static_cast<int>(c)] *
                  nodes[static_cast<size_t>(triangles[static_cast<size_t>(gap.triangle)][c])];
    return place_mm;
  }

  void release(size_t instrument, const Belief& without) {
    Hand& hand = hands[instrument];
    const size_t contact = *hand.contact;
    hand.released_at_mm = hand.last_tip_mm;
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

  ContactPrior prior_of_touch() const {
    ContactPrior prior;
    prior.q_covariance_mm2 = parameters.touch_mm * parameters.touch_mm * Mat3::Identity();
    prior.offset_covariance_mm2 = parameters.offset_mm * parameters.offset_mm * Mat3::Identity();
    prior.log_radius = stated_log_radius();
    prior.skew_deviation = parameters.skew;
    prior.log_radius_deviation = options.drive == Drive::fused ? parameters.log_radius : 1e-3;
    return prior;
  }

  void begin_at(size_t instrument, const Vec3& place_mm, const ContactPrior& prior) {
    Hand& hand = hands[instrument];
    model.begin(place_mm, options.footprint_radius_mm);
    hand.contact = model.contact_count() - 1;
    instrument_of_contact.push_back(instrument);
    hand.released_at_mm.reset();
    hand.slid_from_mm.setZero();
    hand.onset_s = last_time_s;
    belief = with_contact(belief, prior);
    solve_anew();
  }

  /// The contact begins where the operator says; whether it holds is for the tissue to tell.
  void begin_told(size_t instrument, const FrameEvidence& frame) {
    begin_at(instrument, *frame.held_at_mm, prior_of_touch());
    hands[instrument].is_told = true;
    hands[instrument].filter.touch(frame.held_for_sure ? 1 : kHeldUntold);
    hands[instrument].free_scene = belief.scene(about_mm);
  }

  /// The contact begins where the tip is nearest to the surface.
  void begin(size_t instrument, const TipObservation& tip, const Gap& gap, bool unnoticed) {
    Hand& hand = hands[instrument];
    hand.tip_at_mark_mm = tip.tip_mm;
    ContactPrior prior = prior_of_touch();
    if (unnoticed) {
      prior.q_mm = std::min(0.0, gap.distance_mm) * gap.normal;
      const double deviation_mm = parameters.touch_mm + 0.5 * std::abs(gap.distance_mm);
      prior.q_covariance_mm2 = deviation_mm * deviation_mm * Mat3::Identity();
    }
    begin_at(instrument, place_at_rest(gap), prior);
    // Where the tip stands against the patch: the displacement of the first frame is known to touch_mm.
    FrameData data;
    data.seconds = 0.04;
    data.tips.push_back({*hand.contact, tip.tip_mm, Mat3::Zero()});  // from now on the tip counts from here
    const ContactFit fit = fit_linear(belief, data, *body, model, context());
    belief = fit.kept;
    hand.slid_from_mm = belief.offset_mm(*hand.contact);
  }

  /// Where a tip without contact stands against the surface, and whether it touches.
  void look_for_touch(size_t instrument, const TipObservation& tip, double seconds, InstrumentAnswer& answer) {
    Hand& hand = hands[instrument];
    const Vec3 tip_mm = belief.scene(about_mm).undo(tip.tip_mm);
    const Gap gap = gap_of(tip_mm);
    if (hand.released_at_mm && ((tip_mm - *hand.released_at_mm).norm() > kLeft_mm || gap.distance_mm > kLeft_mm))
      hand.released_at_mm.reset();
    if (!hand.last_tip_mm) return;
    FreeTip free;
    free.gap_mm = gap.distance_mm;
    free.gap_deviation_mm = std::sqrt(gap.normal.dot(tip.covariance_mm2 * gap.normal));
    free.step_mm = tip_mm - *hand.last_tip_mm;
    free.step_covariance_mm2 = tip_floor_covariance_mm2(tip_mm, rectification, parameters);
    const bool closes = tip.closed.value_or(false) && hand.was_closed == false;
    const double reach_mm = options.threshold_mm + std::min(2 * free.gap_deviation_mm, 0.5 * options.threshold_mm);
    if (free.gap_mm > reach_mm || tip.closed == false) return;
    TouchEvidence evidence = touch_evidence(free, seconds, parameters);
    if (hand.released_at_mm && !evidence.unnoticed) return;
    const double rate = 1 - std::exp(-parameters.touch_per_s * seconds);
    double log_odds = std::log(rate / (1 - rate)) + evidence.log_ratio;
    if (closes) log_odds = kSure;
    const double probability = 1 / (1 + std::exp(-log_odds));
    if (probability < 0.5) return;
    begin(instrument, tip, gap, evidence.unnoticed && !closes);
    hand.filter.touch(evidence.unnoticed && !closes ? std::min(probability, kUnconfirmed) : probability);
    answer.begins = true;
  }

  /// log p(tip | free) in the map frame; nothing where there is no tip.
  double log_free_tip(size_t instrument, const TipObservation& tip, const Belief& free, double seconds) const {
    if (!tip.visible) return 0;
    const Hand& hand = hands[instrument];
    const Vec3 tip_mm = free.scene(about_mm).undo(tip.tip_mm);
    const double step_mm = parameters.hand_mm_per_s * seconds;
    const Mat3 walk =
        step_mm * step_mm * Mat3::Identity() + tip_floor_covariance_mm2(tip_mm, rectification, parameters);
    const Gap gap = gap_to_surface(tip_mm, rest_mm, rest_boundary);
    const double deviation_mm =
        std::hypot(parameters.gap_mm, std::sqrt(gap.normal.dot(tip.covariance_mm2 * gap.normal)));
    const double from_last =
        hand.last_tip_mm ? log_normal3(tip_mm - *hand.last_tip_mm, walk) : -3 * std::log(parameters.free_space_mm);
    return from_last + log_normal_cdf(gap.distance_mm / deviation_mm);
  }

  Mat3 force_covariance(const ForceAt& at, const ContactFit& fit) const {
    const Mat3 from_images =
        std::max(1.0, fit.chi2_ratio) * at.per_unknown * fit.posterior.covariance * at.per_unknown.transpose();
    const double model_N = parameters.model_error * at.force_N.norm();
    return from_images + model_N * model_N * Mat3::Identity();
  }

  double force_per_mm(size_t contact) const {
    const auto k = 3 * static_cast<Eigen::Index>(contact);
    return std::cbrt(std::max(1e-12, body->response.force.block<3, 3>(k, k).determinant()));
  }

  /// A sliding tip is anywhere along the surface; its force lies on the edge of the cone.
  ContactFit fit_sliding(const Belief& prior, const FrameData& data, size_t contact) const {
    const Vec3 normal = model.footprint(contact).normal;
    Belief sliding = prior;
    const double step_mm = parameters.hand_mm_per_s * data.seconds;
    sliding.covariance.block<3, 3>(Unknowns::offset(contact), Unknowns::offset(contact)) +=
        step_mm * step_mm * (Mat3::Identity() - normal * normal.transpose());
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
      const double deviation_N = 0.5 * options.friction * pressed_N + parameters.touch_mm * force_per_mm(contact);
      m.covariance.setConstant(1, 1, deviation_N * deviation_N);
      m.dof = 1e3;
      cone.push_back(m);
    }
    ContactFit fit = fit_linear(sliding, data, *body, model, context(), cone);
    // The cone tells how likely a slip is, not how narrow it is.
    if (!cone.empty()) fit.log_evidence -= log_student_t(0, std::log(cone[0].covariance(0, 0)), 1, cone[0].dof);
    return fit;
  }

  /// Every hypothesis of one contact on the same data; the contact may end, or slide on.
  void weigh(size_t instrument, const Belief& prior, const FrameData& data, const TipObservation& tip,
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
    if (tip.closed.value_or(false)) log_likelihood[static_cast<size_t>(Hold::free)] = tied.log_evidence - kSure;
    log_likelihood[static_cast<size_t>(Hold::grasp)] = tied.log_evidence;
    const ForceAt force = force_at(*body, tied.posterior, k);
    const Vec3 normal = model.footprint(k).normal;
    log_likelihood[static_cast<size_t>(Hold::push)] =
        tied.log_evidence +
        log_in_friction_cone(force.force_N, force_covariance(force, tied), normal, options.friction);
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
        keep_slow(prior, k, belief);
        return;
      }
      release(instrument, free.kept);
      return;
    }
    if (sliding && hand.filter.most_probable() == Hold::slide) tied = *sliding;
  }

  /// What a contact that is more probably none says about its slow unknowns is not learned.
  static void keep_slow(const Belief& from, size_t contact, Belief& to) {
    forget(from, Unknowns::offset(contact), Unknowns::kContact - 3, to);
  }

  /// Some unknowns as they were believed before.
  static void forget(const Belief& before, Eigen::Index at, Eigen::Index count, Belief& now) {
    if (before.mean.size() != now.mean.size()) return;
    now.mean.segment(at, count) = before.mean.segment(at, count);
    now.covariance.middleRows(at, count).setZero();
    now.covariance.middleCols(at, count).setZero();
    now.covariance.block(at, at, count, count) = before.covariance.block(at, at, count, count);
  }

  bool is_near_its_patch(const TipObservation& tip, const Belief& free, size_t contact) const {
    const Vec3 tip_mm = free.scene(about_mm).undo(tip.tip_mm);
    return (tip_mm - model.footprint(contact).center_mm).norm() < kLeft_mm;
  }

  ContactFit free_of(const Belief& prior, const FrameData& data, size_t contact) {
    const SolvedBody without = without_force(*body, contact);
    // The tips' patches keep their numbers but for the one that is gone.
    const PredictedBody predicted{&without.response, &without.places, without.unknowns(prior), about_mm};
    std::vector<Measurement> rows = tissue_measurements(data.tissue, predicted, rectification, parameters);
    for (const ContactTip& tip : data.tips) {
      const size_t in_model = tip.contact + (tip.contact >= contact);
      rows.push_back(tip_measurement(tip.tip_mm, tip.covariance_mm2, tip.contact, model.footprint(in_model).center_mm,
                                     predicted, rectification, parameters));
    }
    const MapEstimate estimate = maximum_a_posteriori(prior, predicted.x0, rows);
    ContactFit fit;
    fit.posterior = fit.kept = estimate.posterior;
    fit.log_evidence = estimate.log_evidence;
    fit.chi2_ratio = estimate.dof > 0 ? estimate.chi2 / estimate.dof : 1;
    return fit;
  }

  std::optional<ContactTip> contact_tip(const Hand& hand, const TipObservation& tip) const {
    if (!tip.visible) return std::nullopt;
    if (tip.since_mark_mm)
      return ContactTip{*hand.contact, hand.tip_at_mark_mm + *tip.since_mark_mm, tip.since_mark_covariance_mm2};
    return ContactTip{*hand.contact, tip.tip_mm,
                      tip.covariance_mm2 + parameters.gap_mm * parameters.gap_mm * Mat3::Identity()};
  }

  void report(size_t instrument, const ContactFit& fit, const TipObservation& tip, InstrumentAnswer& answer) const {
    const Hand& hand = hands[instrument];
    const size_t k = *hand.contact;
    const SceneMotion scene = fit.posterior.scene(about_mm);
    const Mat3 R = scene.rotation();
    const ForceAt force = force_at(*body, fit.posterior, k);
    answer.hold = hand.filter.most_probable();
    answer.p_contact = hand.filter.p_contact();
    answer.converged = fit.converged;
    answer.force_N = R * force.force_N;
    answer.force_covariance_N2 = R * force_covariance(force, fit) * R.transpose();
    const ContactForce& solved = body->response.equilibrium.contacts[k];
    const double solved_N = solved.force_N.norm();
    answer.mean_nodal_force_N =
        solved_N > 0 ? solved.mean_nodal_force_N * force.force_N.norm() / solved_N : solved.mean_nodal_force_N;
    answer.place_mm = model.footprint(k).center_mm;
    answer.q_mm = fit.posterior.q_mm(k);
    answer.footprint_mm = std::exp(fit.posterior.log_radius(k));
    answer.tip_inferred = !tip.visible;
    answer.tip_mm = scene.apply(model.footprint(k).center_mm + fit.posterior.q_mm(k));
    answer.near_attachment = model.distance_to_attachments_mm(k) < 2 * options.footprint_radius_mm;
  }

  /// Median distance between where tissue is seen and where it is predicted, across the viewing ray, mm; and whether it
  /// is explained.
  double misfit_mm(const FrameData& data, const Belief& at, bool& explained) const {
    PredictedBody predicted{nullptr, nullptr, at.mean, about_mm};
    if (body) predicted = {&body->response, &body->places, body->unknowns(at), about_mm, &patches};
    const std::vector<Measurement> rows = tissue_measurements(data.tissue, predicted, rectification, parameters);
    std::vector<double> misfits;
    size_t unexplained = 0;
    for (size_t i = 0; i < rows.size(); ++i) {
      const Eigen::VectorXd residual = rows[i].residual - rows[i].H * (at.mean - predicted.x0);
      misfits.push_back(residual.head<2>().norm() * data.tissue[i].rest_mm.z() / rectification.focal_px);
      unexplained += residual.dot(rows[i].covariance.ldlt().solve(residual)) > kUnexplained2;
    }
    explained =
        rows.size() < 10 || static_cast<double>(unexplained) < kUnexplainedFraction * static_cast<double>(rows.size());
    if (misfits.empty()) return 0;
    const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2);
    std::nth_element(misfits.begin(), middle, misfits.end());
    return *middle;
  }

  /// Radius and place of the patch as believed by now. A weak force says nothing of the radius.
  void renew_patch(size_t instrument, const Belief& prior, const ContactFit& fit) {
    Hand& hand = hands[instrument];
    const size_t k = *hand.contact;
    const ForceAt force = force_at(*body, fit.posterior, k);
    const double deviation_N = std::sqrt(force_covariance(force, fit).trace() / 3);
    // Learned without the operator's word, which each fit hears anew; the patch is laid as it is believed with it.
    double& learned = belief.mean[Unknowns::log_radius(k)];
    double log_radius = fit.posterior.log_radius(k);
    if (force.force_N.norm() < parameters.telling_force * deviation_N) {
      forget(prior, Unknowns::log_radius(k), 1, belief);
      return;
    }
    learned = std::clamp(learned, stated_log_radius() + std::log(parameters.min_radius_ratio),
                         stated_log_radius() + std::log(parameters.max_radius_ratio));
    log_radius = std::clamp(log_radius, stated_log_radius() + std::log(parameters.min_radius_ratio),
                            stated_log_radius() + std::log(parameters.max_radius_ratio));
    if (hand.filter.most_probable() == Hold::slide) {
      const Vec3 normal = model.footprint(k).normal;
      Vec3 slid_mm = belief.offset_mm(k) - hand.slid_from_mm;
      slid_mm -= slid_mm.dot(normal) * normal;
      if (slid_mm.norm() > kSlideReach_radii * std::exp(log_radius)) {
        const Vec3 from_mm = model.footprint(k).center_mm;
        model.move(k, from_mm + slid_mm);
        belief.mean.segment<3>(Unknowns::offset(k)) -= model.footprint(k).center_mm - from_mm;
        hand.slid_from_mm = belief.offset_mm(k);
        solve_anew();
        return;
      }
    }
    if (std::abs(log_radius - std::log(model.radius_mm(k))) > kRadiusChange) {
      const std::optional<Equilibrium> equilibrium = model.set_radius(k, std::exp(log_radius), body->q_mm);
      if (!equilibrium) return;
      body->response = model.respond(*equilibrium, body->q_mm);
      body->log_radius[k] = std::log(model.radius_mm(k));
    }
  }
};

ForceFilter::ForceFilter(ContactModel model, const AttachedMesh& map, std::vector<TissuePoint> points,
                         const Rectification& rectification, const ContactOptions& contact,
                         const InferenceParameters& parameters)
    : state_(std::make_unique<State>(std::move(model), map, std::move(points), rectification, contact, parameters)) {}
ForceFilter::~ForceFilter() = default;
ForceFilter::ForceFilter(ForceFilter&&) noexcept = default;

const ContactModel& ForceFilter::model() const {
  return state_->model;
}

std::vector<TissuePoint> ForceFilter::wanted_points() const {
  const State& s = *state_;
  std::vector<char> is_wanted(s.points.size(), 0);
  for (size_t i : s.even_points) is_wanted[i] = 1;
  for (size_t k = 0; k < s.model.contact_count(); ++k) {
    const double excluded_mm = s.excluded_mm(k);
    std::vector<std::pair<double, size_t>> around;
    for (size_t i = 0; i < s.points.size(); ++i)
      if (const double distance_mm = (s.points[i].rest_mm - s.model.footprint(k).center_mm).norm();
          distance_mm > excluded_mm)
        around.emplace_back(distance_mm, i);
    const auto last = around.begin() + static_cast<std::ptrdiff_t>(std::min(kNearPoints, around.size()));
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
  State& s = *state_;
  FrameAnswer answer;
  const double seconds = s.begun ? std::clamp(frame.time_s - s.last_time_s, 1e-3, 1.0) : 0.04;
  s.begun = true;
  s.last_time_s = frame.time_s;
  const Belief prior = predict(s.belief, seconds, s.parameters);
  for (Hand& hand : s.hands)
    if (hand.contact) hand.filter.predict(seconds, s.parameters);

  s.patches = s.reaches(prior);
  FrameData data;
  data.tissue = s.usable(frame.tissue);
  data.seconds = seconds;
  for (const Hand& hand : s.hands)
    if (hand.contact)
      if (const auto tip = s.contact_tip(hand, frame.tips[static_cast<size_t>(&hand - s.hands.data())]))
        data.tips.push_back(*tip);

  ContactFit fit =
      s.body ? fit_contacts(prior, data, *s.body, s.model, s.context()) : fit_at_rest(prior, data, s.context());
  s.belief = fit.kept;
  if (s.body && fit.converged) {
    const std::vector<size_t> touching = s.instrument_of_contact;
    for (size_t instrument : touching) {
      s.weigh(instrument, prior, data, frame.tips[instrument], fit);
      if (!s.hands[instrument].contact) break;  // the others are weighed again in the next frame
      if (s.hands[instrument].filter.most_probable() == Hold::slide) s.belief = fit.kept;
    }
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
  if (fit.converged)
    for (size_t instrument : std::vector<size_t>(s.instrument_of_contact)) s.renew_patch(instrument, prior, fit);
  for (size_t i = 0; i < s.hands.size(); ++i) {
    const TipObservation& tip = frame.tips[i];
    Hand& hand = s.hands[i];
    if (!tip.visible) {
      hand.last_tip_mm.reset();
      if (i == 0 && !hand.contact && frame.held_at_mm) s.begin_told(i, frame);
      continue;
    }
    if (!hand.contact && frame.may_touch) {
      s.look_for_touch(i, tip, seconds, answer.instruments[i]);
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
  return answer;
}

}  // namespace palpate
