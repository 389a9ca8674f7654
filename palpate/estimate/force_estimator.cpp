#include "palpate/estimate/force_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

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

}  // namespace

struct ForceEstimator::State {
  TissueMap map;
  std::vector<Triangle> boundary;
  Rectification rectification;
  AttachmentOptions attachments;
  ContactOptions options;
  InstrumentTracker tracker;
  MapWatch map_watch;
  std::array<cv::Mat, 2> last_pictures;
  OnsetDetector onset;
  TissueMotion tissue_motion;
  std::shared_ptr<TouchedBody> body;
  std::optional<TipContact> contact;
  Vec3 onset_tip_mm = Vec3::Zero();
  Vec3 last_tip_mm = Vec3::Zero();
  std::optional<bool> was_closed;  // jaws of the free tip, where a tip track says so
  int lost_frames = 0;             // up to this one, without a gap
  double last_seen_s = 0;

  State(TissueMap m, const StereoFrame& static_frame, const Rectification& r, const AttachmentOptions& a,
        const InstrumentOptions& instrument, const ContactOptions& contact_options)
      : map(std::move(m)),
        boundary(boundary_triangles(map.mesh)),
        rectification(r),
        attachments(a),
        options(contact_options),
        tracker(instrument, rectification, rectify(rectification, static_frame), map.organ_mask),
        map_watch(rectify(rectification, static_frame).left, {}),
        onset(contact_options.threshold_mm),
        tissue_motion(rectification) {
    const auto around = [this](const std::vector<Vec3>& places_mm) { return mesh_around(places_mm); };
    body = std::make_shared<TouchedBody>(around, map.tissue, map.element, options.footprint_radius_mm);
  }

  bool is_repeated(const RectifiedPair& pair) {
    std::array<cv::Mat, 2> pictures = {every_fourth_pixel(pair.left), every_fourth_pixel(pair.right)};
    std::swap(pictures, last_pictures);
    return same_picture(pictures[0], last_pictures[0]) && same_picture(pictures[1], last_pictures[1]);
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

  void begin_contact(const RectifiedPair& pair, const InstrumentObservations& seen, const Gap& gap) {
    contact.reset();
    contact.emplace(HeldContact(body, gap.surface_point_mm, options), options.grip);
    onset_tip_mm = seen.tips[0].tip_mm;
    tracker.mark(0);
    tissue_motion.start(pair, seen.left_mask, gap.surface_point_mm,
                        std::max(kLeastWatched_mm, kWatchedRadii * options.footprint_radius_mm));
  }

  void end_contact(const Vec3& tip_mm) {
    contact.reset();
    tracker.unmark(0);
    tissue_motion.stop();
    onset.let_go(tip_mm);
  }

  /// Where the free tip stands against the map at rest, and whether it begins to touch (Eq. 4).
  void look_for_contact(const RectifiedPair& pair, const InstrumentObservations& seen) {
    const TipObservation& tip = seen.tips[0];
    const Gap gap = gap_to_surface(tip.tip_mm, map.mesh.nodes_mm, boundary);
    const double deviation_mm = std::sqrt(gap.normal.dot(tip.covariance_mm2 * gap.normal));
    const bool comes_to_rest = onset.update(gap.distance_mm, deviation_mm, tip.tip_mm);
    const bool closes = tip.closed.value_or(false) && was_closed == false && gap.distance_mm < options.threshold_mm;
    was_closed = tip.closed;
    if (closes || (comes_to_rest && tip.closed.value_or(true))) begin_contact(pair, seen, gap);
  }

  /// u, lambda of Eq. 3 for the tip's displacement since onset; ends the contact when the image or the grip says so.
  std::optional<Equilibrium> solve_contact(const RectifiedPair& pair, const InstrumentObservations& instruments,
                                           ForceEstimate& estimate) {
    const TipObservation& tip = instruments.tips[0];
    if (tip.closed && !*tip.closed) {
      end_contact(tip.tip_mm);
      was_closed = false;
      return std::nullopt;
    }
    const Vec3 p = tip.since_mark_mm.value_or(tip.tip_mm - onset_tip_mm);
    const std::vector<TissuePoint> seen = tissue_motion.update(pair, instruments.left_mask, instruments.right_mask);
    TipContact::Answer answer = contact->update(p, seen, lost_frames > kFlickerFrames);
    if (answer.state == TipContact::State::unsettled && onset.may_begin_again()) {
      begin_contact(pair, instruments, gap_to_surface(tip.tip_mm, map.mesh.nodes_mm, boundary));
      answer = contact->update(Vec3::Zero(), {});
    }
    if (answer.state == TipContact::State::over || answer.state == TipContact::State::unsettled)
      end_contact(tip.tip_mm);
    if (answer.state != TipContact::State::touching) return std::nullopt;
    estimate.tip_mm = answer.tip_mm;
    estimate.misfit_mm = answer.misfit_mm;
    if (answer.slid) estimate.warnings.push_back("sliding");
    return std::move(answer.equilibrium);
  }

  void report(const Equilibrium& equilibrium, ForceEstimate& estimate) const {
    estimate.in_contact = true;
    estimate.residual = equilibrium.residual;
    estimate.status = FrameStatus::not_converged;
    if (contact->held().near_attachment()) estimate.warnings.push_back("near_attachment");
    if (!body->model().in_valid_range(equilibrium.u)) estimate.warnings.push_back("law_out_of_range");
    // At the rim of a pushed patch a few elements of Saint Venant-Kirchhoff turn inside out long before the force does.
    if (equilibrium.smallest_volume_ratio <= 0) estimate.warnings.push_back("inverted_elements");
    if (!equilibrium.converged) return;
    estimate.status = estimate.misfit_mm > kStaleMisfit_mm ? FrameStatus::map_stale : FrameStatus::ok;
    estimate.force_N = equilibrium.force_N;
    estimate.mean_nodal_force_N = equilibrium.mean_nodal_force_N;
    estimate.deformed_nodes_mm = deformed(body->model(), equilibrium.u);
    estimate.boundary = body->boundary();
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
  Stopwatch watch;

  const RectifiedPair pair = rectify(s.rectification, frame);
  const bool repeated = s.is_repeated(pair);
  estimate.times.rectify_ms = watch.lap_ms();

  const InstrumentObservations seen = s.tracker.update(pair);
  const TipObservation& tip = seen.tips[0];
  estimate.left_instrument_mask = seen.left_mask;
  if (seen.eyes_out_of_step) estimate.warnings.push_back("eyes_out_of_step");
  MapWatch::Answer scene;
  if (frame.index > s.map.frame) scene = s.map_watch.update(pair.left, seen.left_mask);
  estimate.times.track_ms = watch.lap_ms();

  if (!tip.visible || scene.veiled) {
    estimate.status = FrameStatus::tool_lost;
    ++s.lost_frames;
    if (s.contact && frame.time_s - s.last_seen_s > kLongestLost_s) s.end_contact(s.last_tip_mm);
    if (!s.contact) s.onset.lose();
    return estimate;
  }
  s.last_seen_s = frame.time_s;
  s.last_tip_mm = tip.tip_mm;
  estimate.tip_mm = tip.tip_mm;

  // Where the map no longer lies nothing begins to touch it, and a picture that stands still says nothing about the
  // tip.
  const bool stale = scene.map_is_stale;
  if (stale) estimate.status = FrameStatus::map_stale;
  if (!s.contact && !stale && !repeated && frame.index > s.map.frame) s.look_for_contact(pair, seen);
  estimate.times.contact_ms = watch.lap_ms();
  if (!s.contact) {
    s.lost_frames = 0;
    return estimate;
  }

  const auto equilibrium = s.solve_contact(pair, seen, estimate);
  s.lost_frames = 0;
  estimate.times.solve_ms = watch.lap_ms();
  if (!equilibrium) return estimate;

  s.report(*equilibrium, estimate);
  if (stale && estimate.status == FrameStatus::ok) estimate.status = FrameStatus::map_stale;
  if (estimate.status == FrameStatus::not_converged) return estimate;
  estimate.node_von_mises_kPa = node_von_mises_kPa(s.body->model(), equilibrium->u);
  estimate.max_von_mises_kPa =
      *std::max_element(estimate.node_von_mises_kPa.begin(), estimate.node_von_mises_kPa.end());
  estimate.times.stress_ms = watch.lap_ms();
  return estimate;
}

}  // namespace palpate
