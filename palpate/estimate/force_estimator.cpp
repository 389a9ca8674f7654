#include "palpate/estimate/force_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "palpate/contact/detect.h"
#include "palpate/contact/map_watch.h"
#include "palpate/contact/onset.h"
#include "palpate/contact/tip_contact.h"
#include "palpate/contact/tissue_motion.h"
#include "palpate/core/stopwatch.h"
#include "palpate/elastic/stress.h"

namespace palpate {

namespace {

/// Time without the tip after which a held contact is given up. Until then the contact waits: whether the tip still
/// holds the tissue when it is seen again is what the tissue's motion says.
constexpr double kLongestLost_s = 2;
/// After a longer loss than a flicker, the tissue has to be seen to follow.
constexpr int kFlickerFrames = 5;
/// Elements around the footprint are split until their edges are no longer than its radius: finer ones change the force
/// by less than 3 %.
constexpr double kFootprintEdgeShare = 1;
constexpr double kFootprintReach = 1;
/// The ring of tissue watched around a contact, in footprint radii and at least so wide.
constexpr double kWatchedRadii = 3.5;
constexpr double kLeastWatched_mm = 8;
constexpr double kStaleMisfit_mm = 3;

/// A part of the picture that tells whether it is the same one again; a copy, because grabbers use their buffers again.
cv::Mat every_fourth_pixel(const cv::Mat& picture) {
  cv::Mat part;
  cv::resize(picture, part, {}, 0.25, 0.25, cv::INTER_NEAREST);
  return part;
}

/// Decoders and grabbers hand out a picture twice when none is new; two pictures of a camera always differ by noise.
bool same_picture(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || a.size() != b.size()) return false;
  constexpr double kLeastNoise_levels = 0.02;
  return cv::norm(a, b, cv::NORM_L1) < kLeastNoise_levels * 3 * static_cast<double>(a.total());
}

std::vector<Vec3> deformed(const TetModel& model, const Eigen::VectorXd& u) {
  std::vector<Vec3> nodes = model.rest_mm();
  for (size_t n = 0; n < nodes.size(); ++n) nodes[n] += u.segment<3>(3 * static_cast<Eigen::Index>(n));
  return nodes;
}

/// What is kept of one instrument: free, touching or lost.
struct Hand {
  Hand(size_t number, double threshold_mm, const Rectification& rectification)
      : instrument(number), onset(threshold_mm), tissue_motion(rectification) {}

  size_t instrument;
  OnsetDetector onset;
  TissueMotion tissue_motion;
  std::optional<TipContact> contact;
  Vec3 onset_tip_mm = Vec3::Zero();
  Vec3 last_tip_mm = Vec3::Zero();
  std::optional<bool> was_closed;  // jaws of the free tip, where a tip track says so
  int lost_frames = 0;             // up to this one, without a gap
  double last_seen_s = 0;
};

/// What a frame shows, and whether the map still lies where it was built.
struct SeenFrame {
  RectifiedPair pair;
  InstrumentObservations instruments;
  bool repeated = false;
  MapWatch::Answer scene;
};

}  // namespace

struct ForceEstimator::State {
  TissueMap map;
  Rectification rectification;
  AttachmentOptions attachments;
  ContactOptions options;
  InstrumentTracker tracker;
  MapWatch map_watch;
  std::array<cv::Mat, 2> last_pictures;
  std::shared_ptr<TouchedBody> body;
  std::vector<Hand> hands;
  // The body's surface as last computed, and the same at rest: what a free tip may touch.
  bool is_at_rest = false;
  std::vector<Triangle> boundary;
  std::vector<Vec3> rest_mm, deformed_mm;

  State(TissueMap m, const StereoFrame& static_frame, const Rectification& r, const AttachmentOptions& a,
        const InstrumentOptions& instrument, const ContactOptions& contact_options)
      : map(std::move(m)),
        rectification(r),
        attachments(a),
        options(contact_options),
        tracker(instrument, rectification, rectify(rectification, static_frame), map.organ_mask),
        map_watch(rectify(rectification, static_frame).left, {}) {
    const auto around = [this](const std::vector<Vec3>& places_mm) { return mesh_around(places_mm); };
    body = std::make_shared<TouchedBody>(around, map.tissue, map.element, options.footprint_radius_mm);
    for (size_t i = 0; i < kMostInstruments; ++i) hands.emplace_back(i, options.threshold_mm, rectification);
    come_to_rest();
  }

  /// The map, finer around places that are touched.
  AttachedMesh mesh_around(const std::vector<Vec3>& places_mm) const {
    const double radius_mm = options.footprint_radius_mm;
    AttachedMesh attached{map.mesh, {}};
    for (const Vec3& place_mm : places_mm)
      attached.mesh =
          refine_near(attached.mesh, place_mm, kFootprintReach * radius_mm, kFootprintEdgeShare * radius_mm);
    attached.fixed_nodes = select_attachments(attached.mesh, attachments, [this](const Vec3& point) {
      return project_to_recorded_left(rectification.rig, point);
    });
    return attached;
  }

  void come_to_rest() {
    if (std::exchange(is_at_rest, true)) return;
    boundary = boundary_triangles(map.mesh);
    rest_mm = deformed_mm = map.mesh.nodes_mm;
  }

  SeenFrame look(const StereoFrame& frame, FrameTimes& times) {
    Stopwatch watch;
    SeenFrame seen;
    seen.pair = rectify(rectification, frame);
    std::array<cv::Mat, 2> pictures = {every_fourth_pixel(seen.pair.left), every_fourth_pixel(seen.pair.right)};
    std::swap(pictures, last_pictures);
    seen.repeated = same_picture(pictures[0], last_pictures[0]) && same_picture(pictures[1], last_pictures[1]);
    times.rectify_ms = watch.lap_ms();
    seen.instruments = tracker.update(seen.pair);
    if (frame.index > map.frame) seen.scene = map_watch.update(seen.pair.left, seen.instruments.left_mask);
    times.track_ms = watch.lap_ms();
    return seen;
  }

  void begin_contact(Hand& hand, const SeenFrame& seen, const Gap& gap) {
    const Triangle& corners = boundary[static_cast<size_t>(gap.triangle)];
    Vec3 place_mm = Vec3::Zero();
    for (size_t c = 0; c < 3; ++c)
      place_mm += gap.barycentric[static_cast<int>(c)] * rest_mm[static_cast<size_t>(corners[c])];
    hand.contact.reset();
    hand.contact.emplace(HeldContact(body, place_mm, options), options.grip);
    hand.onset_tip_mm = seen.instruments.tips[hand.instrument].tip_mm;
    tracker.mark(hand.instrument);
    hand.tissue_motion.start(seen.pair, seen.instruments.left_mask, gap.surface_point_mm,
                             std::max(kLeastWatched_mm, kWatchedRadii * options.footprint_radius_mm));
  }

  void end_contact(Hand& hand, const Vec3& tip_mm) {
    hand.contact.reset();
    tracker.unmark(hand.instrument);
    hand.tissue_motion.stop();
    hand.onset.let_go(tip_mm);
  }

  bool none_touches() const {
    return std::none_of(hands.begin(), hands.end(), [](const Hand& hand) { return hand.contact.has_value(); });
  }

  /// The contact began too early, so that the tissue as last computed is not where it is.
  bool begin_again(Hand& hand, const SeenFrame& seen) {
    hand.contact.reset();
    if (none_touches()) come_to_rest();
    const Gap gap = gap_of(seen.instruments.tips[hand.instrument]);
    if (!hand.onset.may_begin_again(gap.distance_mm)) return false;
    begin_contact(hand, seen, gap);
    return true;
  }

  Gap gap_of(const TipObservation& tip) const { return gap_to_surface(tip.tip_mm, deformed_mm, boundary); }

  /// Where the free tip stands against the surface, and whether it begins to touch (Eq. 4).
  void look_for_contact(Hand& hand, const SeenFrame& seen) {
    const TipObservation& tip = seen.instruments.tips[hand.instrument];
    const Gap gap = gap_of(tip);
    const double deviation_mm = std::sqrt(gap.normal.dot(tip.covariance_mm2 * gap.normal));
    const bool comes_to_rest = hand.onset.update(gap.distance_mm, deviation_mm, tip.tip_mm);
    const bool closes =
        tip.closed.value_or(false) && hand.was_closed == false && gap.distance_mm < options.threshold_mm;
    hand.was_closed = tip.closed;
    if (closes || (comes_to_rest && tip.closed.value_or(true))) begin_contact(hand, seen, gap);
  }

  /// Whether the tip is seen and where; begins a contact when it touches, gives one up that was not seen for too long.
  void follow_tip(Hand& hand, const SeenFrame& seen, ForceEstimate& estimate) {
    const TipObservation& tip = seen.instruments.tips[hand.instrument];
    if (seen.instruments.eyes_out_of_step) estimate.warnings.push_back("eyes_out_of_step");
    if (!tip.visible || seen.scene.veiled) {
      estimate.status = FrameStatus::tool_lost;
      ++hand.lost_frames;
      if (hand.contact && estimate.time_s - hand.last_seen_s > kLongestLost_s) end_contact(hand, hand.last_tip_mm);
      if (!hand.contact) hand.onset.lose();
      return;
    }
    hand.last_seen_s = estimate.time_s;
    hand.last_tip_mm = tip.tip_mm;
    estimate.tip_mm = tip.tip_mm;
    // Where the map no longer lies nothing begins to touch it, and a picture that stands still says nothing about the
    // tip.
    if (seen.scene.map_is_stale) estimate.status = FrameStatus::map_stale;
    const bool may_touch = !seen.scene.map_is_stale && !seen.repeated && estimate.frame > map.frame;
    if (!hand.contact && may_touch) look_for_contact(hand, seen);
    if (!hand.contact) hand.lost_frames = 0;
  }

  /// u, lambda of Eq. 3 for the tip's displacement since onset; ends the contact when the image or the grip says so.
  std::optional<TipContact::Answer> solve_contact(Hand& hand, const SeenFrame& seen, ForceEstimate& estimate) {
    const TipObservation& tip = seen.instruments.tips[hand.instrument];
    const bool has_to_be_seen = std::exchange(hand.lost_frames, 0) > kFlickerFrames;
    if (tip.closed && !*tip.closed) {
      end_contact(hand, tip.tip_mm);
      hand.was_closed = false;
      return std::nullopt;
    }
    const Vec3 p = tip.since_mark_mm.value_or(tip.tip_mm - hand.onset_tip_mm);
    const std::vector<TissuePoint> tissue =
        hand.tissue_motion.update(seen.pair, seen.instruments.left_mask, seen.instruments.right_mask);
    TipContact::Answer answer = hand.contact->update(p, tissue, has_to_be_seen);
    if (answer.state == TipContact::State::unsettled && begin_again(hand, seen))
      answer = hand.contact->update(Vec3::Zero(), {});
    if (answer.state == TipContact::State::over || answer.state == TipContact::State::unsettled)
      end_contact(hand, tip.tip_mm);
    if (answer.state != TipContact::State::touching) return std::nullopt;
    estimate.tip_mm = answer.tip_mm;
    estimate.misfit_mm = answer.misfit_mm;
    if (answer.slid) estimate.warnings.push_back("sliding");
    return answer;
  }

  /// The equilibrium under all tips that touch. Where there was more than `one_tip`, what a later one did in this frame
  /// counts for the earlier ones, too.
  Equilibrium solve_together(const std::vector<std::optional<TipContact::Answer>>& answers, bool one_tip) {
    Equilibrium last;
    for (size_t i = 0; i < hands.size(); ++i) {
      if (!answers[i]) continue;
      const int tip = hands[i].contact->held().number();
      const std::optional<Vec3>& tied_mm = answers[i]->tied_mm;
      last = one_tip ? answers[i]->equilibrium : tied_mm ? body->solve(tip, *tied_mm) : body->solve_without(tip);
    }
    return last;
  }

  void report(const Hand& hand, const Equilibrium& equilibrium, bool map_is_stale, ForceEstimate& estimate) const {
    const ContactForce& own = equilibrium.contacts[static_cast<size_t>(hand.contact->held().number())];
    estimate.in_contact = true;
    estimate.residual = equilibrium.residual;
    estimate.status = FrameStatus::not_converged;
    if (hand.contact->held().near_attachment()) estimate.warnings.push_back("near_attachment");
    if (!body->model().in_valid_range(equilibrium.u)) estimate.warnings.push_back("law_out_of_range");
    // At the rim of a pushed patch a few elements of Saint Venant-Kirchhoff turn inside out long before the force does.
    if (equilibrium.smallest_volume_ratio <= 0) estimate.warnings.push_back("inverted_elements");
    if (!equilibrium.converged) return;
    const bool stale = map_is_stale || estimate.misfit_mm > kStaleMisfit_mm;
    estimate.status = stale ? FrameStatus::map_stale : FrameStatus::ok;
    estimate.force_N = own.force_N;
    estimate.mean_nodal_force_N = own.mean_nodal_force_N;
  }

  /// The deformed surface for drawing and for tips that come, and its stress.
  void show(const Equilibrium& equilibrium, ForceEstimate& estimate) {
    is_at_rest = false;
    boundary = body->boundary();
    rest_mm = body->model().rest_mm();
    deformed_mm = deformed(body->model(), equilibrium.u);
    estimate.boundary = boundary;
    estimate.deformed_nodes_mm = deformed_mm;
    estimate.node_von_mises_kPa = node_von_mises_kPa(body->model(), equilibrium.u);
    estimate.max_von_mises_kPa =
        *std::max_element(estimate.node_von_mises_kPa.begin(), estimate.node_von_mises_kPa.end());
    for (ForceEstimate& other : estimate.further)
      if (other.in_contact) other.max_von_mises_kPa = estimate.max_von_mises_kPa;
    if (!estimate.in_contact) estimate.max_von_mises_kPa = 0;
  }
};

ForceEstimator::ForceEstimator(TissueMap map, const StereoFrame& static_frame, const Rectification& rectification,
                               const AttachmentOptions& attachments, const InstrumentOptions& instrument,
                               const ContactOptions& contact)
    : state_(std::make_unique<State>(std::move(map), static_frame, rectification, attachments, instrument, contact)) {}
ForceEstimator::~ForceEstimator() = default;
ForceEstimator::ForceEstimator(ForceEstimator&&) noexcept = default;

const TissueMap& ForceEstimator::map() const {
  return state_->map;
}

ForceEstimate ForceEstimator::update(const StereoFrame& frame) {
  State& s = *state_;
  ForceEstimate estimate;
  estimate.frame = frame.index;
  estimate.time_s = frame.time_s;
  estimate.further.resize(kMostInstruments - 1, estimate);
  const auto of = [&estimate](size_t instrument) -> ForceEstimate& {
    return instrument == 0 ? estimate : estimate.further[instrument - 1];
  };
  const SeenFrame seen = s.look(frame, estimate.times);
  estimate.left_instrument_mask = seen.instruments.left_mask;

  Stopwatch watch;
  for (Hand& hand : s.hands) s.follow_tip(hand, seen, of(hand.instrument));
  estimate.times.contact_ms = watch.lap_ms();

  const auto tips = std::count_if(s.hands.begin(), s.hands.end(), [](const Hand& h) { return h.contact.has_value(); });
  std::vector<std::optional<TipContact::Answer>> answers(s.hands.size());
  for (Hand& hand : s.hands)
    if (hand.contact && of(hand.instrument).status != FrameStatus::tool_lost)
      answers[hand.instrument] = s.solve_contact(hand, seen, of(hand.instrument));
  const Equilibrium equilibrium = s.solve_together(answers, tips == 1);
  estimate.times.solve_ms = watch.lap_ms();

  for (const Hand& hand : s.hands)
    if (answers[hand.instrument]) s.report(hand, equilibrium, seen.scene.map_is_stale, of(hand.instrument));
  if (equilibrium.converged) s.show(equilibrium, estimate);
  if (s.none_touches()) s.come_to_rest();
  estimate.times.stress_ms = watch.lap_ms();
  for (ForceEstimate& other : estimate.further) other.times = estimate.times;
  return estimate;
}

}  // namespace palpate
