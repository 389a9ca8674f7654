#include "palpate/estimate/force_estimator.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "palpate/core/errors.h"
#include "palpate/core/stopwatch.h"
#include "palpate/elastic/stress.h"
#include "palpate/estimate/map_model.h"
#include "palpate/estimate/touchable.h"
#include "palpate/infer/band.h"
#include "palpate/infer/force_filter.h"
#include "palpate/observe/picture_quality.h"
#include "palpate/observe/tissue_tracker.h"

namespace palpate {

namespace {

/// A patch all of whose radius lies beyond the edge of what was seen finds half the tissue to hold it, or all: log 2 at
/// two deviations.
constexpr double kEdgeLogDeviation = 0.35;
/// A tip so near to tissue that is no part of the map touches it: both depths are wrong by that.
constexpr double kOnTissue_mm = 1;
/// Tissue that is pulled farther than its attachments are is not told by any law of moderate strain.
constexpr double kMaxStretch = 1;
/// A face whose sides grew by this ratio shows no tissue that was seen.
constexpr double kMaxGrowth = 3;

bool is_sliver(const Triangle& face, const std::vector<Vec3>& rest_mm, const std::vector<Vec3>& now_mm) {
  for (size_t k = 0; k < 3; ++k) {
    const auto a = static_cast<size_t>(face[k]), b = static_cast<size_t>(face[(k + 1) % 3]);
    if ((now_mm[a] - now_mm[b]).norm() > kMaxGrowth * (rest_mm[a] - rest_mm[b]).norm()) return true;
  }
  return false;
}

/// The tissue that was measured at a pixel of the recorded left image; nothing for no pixel. Throws BadInput.
std::optional<Vec3> place_at(const TissueMap& map, const Rectification& rectification,
                             const std::vector<cv::Point2d>& at_px) {
  if (at_px.empty()) return std::nullopt;
  constexpr double kFarthest_px = 15;
  double nearest_px = kFarthest_px;
  std::optional<Vec3> place_mm;
  for (const Vec3& point_mm : map.cloud.position_mm) {
    const double distance_px = cv::norm(project_to_recorded_left(rectification.rig, point_mm) - at_px.front());
    if (distance_px >= nearest_px) continue;
    nearest_px = distance_px;
    place_mm = point_mm;
  }
  if (!place_mm)
    throw BadInput(
        fmt::format("contact.at_px is [{:g}, {:g}], where no tissue was measured, expected a pixel of the organ",
                    at_px.front().x, at_px.front().y));
  return place_mm;
}

}  // namespace

struct ForceEstimator::State {
  TissueMap map;
  Rectification rectification;
  InferenceParameters tuning;
  ForceUncertainty uncertainty;
  double radius_mm;
  std::optional<Vec3> held_at_mm;  ///< where the operator says that the tissue is held
  int held_from_frame;
  InstrumentTracker instruments;
  PictureWatch pictures;
  TissueTracker tissue;
  ForceFilter filter;
  Touchable touchable;
  int drawn_mesh = -1;  ///< version of the mesh whose drawn faces these are
  std::vector<Triangle> drawn_faces;

  State(TissueMap m, const RectifiedPair& rest, const Rectification& r, const InstrumentOptions& instrument,
        const ContactOptions& contact, const InferenceParameters& t, ForceUncertainty u)
      : map(std::move(m)),
        rectification(r),
        tuning(t),
        uncertainty(std::move(u)),
        radius_mm(contact.footprint_radius_mm),
        held_at_mm(place_at(map, r, contact.at_px)),
        held_from_frame(contact.at_frame),
        instruments(instrument, r, rest, map.organ_mask),
        pictures(rest.left),
        tissue(rest, r, map.disparity.disparity_px, map.organ_mask & r.valid_left),
        filter(contact_model(map, r, radius_mm), {map.mesh, map.fixed_nodes}, tissue.points(), r, contact, t),
        touchable(map, r) {}

  /// One row of forces.csv. `tip_known`: seen, or told by the operator.
  void report(const InstrumentAnswer& answer, const FrameAnswer& whole, bool tip_known, ForceEstimate& estimate) {
    estimate.tip_mm = answer.tip_mm;
    estimate.grip = answer.hold;
    estimate.p_contact = answer.p_contact;
    estimate.misfit_mm = answer.misfit_mm;
    estimate.in_contact = answer.hold != Hold::free;
    estimate.status = tip_known ? FrameStatus::no_contact : FrameStatus::tool_lost;
    estimate.footprint_mm = radius_mm;
    estimate.band = {0, unnoticed_force_N(map.tissue, radius_mm, tuning)};
    estimate.total_band = total_band(estimate.band, 0, uncertainty.modulus);
    if (!estimate.in_contact) {
      if (tip_known && !whole.explained) estimate.status = FrameStatus::map_stale;
      if (tip_known &&
          (answer.is_off_limits || touchable.is_on_other_tissue(whole.scene.undo(answer.tip_mm), kOnTissue_mm)))
        estimate.warnings.push_back("contact_outside_map");
      return;
    }
    const Equilibrium& equilibrium = *whole.equilibrium;
    estimate.residual = equilibrium.residual;
    estimate.footprint_mm = answer.footprint_mm;
    if (answer.near_attachment) estimate.warnings.push_back("near_attachment");
    if (!filter.model().model().in_valid_range(equilibrium.u)) estimate.warnings.push_back("law_out_of_range");
    // At the rim of a pushed patch a few elements of Saint Venant-Kirchhoff turn inside out long before the force does.
    if (equilibrium.smallest_volume_ratio <= 0) estimate.warnings.push_back("inverted_elements");
    if (answer.hold == Hold::slide) estimate.warnings.push_back("sliding");
    if (answer.tip_inferred) estimate.warnings.push_back("tip_inferred");
    estimate.status = FrameStatus::not_converged;
    if (!answer.converged) return;
    estimate.force_N = answer.force_N;
    estimate.tangent = answer.tangent;
    estimate.mean_nodal_force_N = answer.mean_nodal_force_N;
    estimate.band = force_band(answer.force_N, answer.force_covariance_N2);
    if (const double beyond = touchable.beyond_edge(answer.place_mm, answer.footprint_mm); beyond > 0) {
      estimate.warnings.push_back("near_map_edge");
      estimate.band = total_band(estimate.band, answer.force_N.norm(), kEdgeLogDeviation * beyond);
    }
    estimate.correlation = answer.correlation;
    estimate.total_band =
        total_band(estimate.band, answer.force_N.norm(), uncertainty.log_deviation(answer.place_mm, answer.q_mm));
    const bool is_believed = whole.explained && answer.stretch < kMaxStretch;
    estimate.status = is_believed ? FrameStatus::ok : FrameStatus::map_stale;
    const double half_width_N = 0.5 * (estimate.band.high_N - estimate.band.low_N);
    if (!answer.tip_inferred || half_width_N < 2 * tuning.telling_deviation * estimate.force_N.norm()) return;
    estimate.status = FrameStatus::tool_lost;
    estimate.in_contact = false;
    estimate.force_N.setZero();
    estimate.tangent = {};
    estimate.mean_nodal_force_N = 0;
  }

  /// The deformed surface that was seen, for drawing, where it lies now, and its stress.
  void show(const FrameAnswer& answer, ForceEstimate& estimate) {
    const TetModel& model = filter.model().model();
    const Eigen::VectorXd& u = answer.equilibrium->u;
    if (drawn_mesh != filter.model().mesh_version()) {
      drawn_mesh = filter.model().mesh_version();
      drawn_faces = touchable.seen_faces(model.rest_mm(), filter.model().boundary());
    }
    estimate.deformed_nodes_mm = model.rest_mm();
    for (size_t n = 0; n < estimate.deformed_nodes_mm.size(); ++n) {
      Vec3& node = estimate.deformed_nodes_mm[n];
      node = answer.scene.apply(node + u.segment<3>(3 * static_cast<Eigen::Index>(n)));
    }
    for (const Triangle& face : drawn_faces)
      if (!is_sliver(face, model.rest_mm(), estimate.deformed_nodes_mm)) estimate.boundary.push_back(face);
    estimate.node_von_mises_kPa = node_von_mises_kPa(model, u);
    const double max_kPa = *std::max_element(estimate.node_von_mises_kPa.begin(), estimate.node_von_mises_kPa.end());
    if (estimate.in_contact) estimate.max_von_mises_kPa = max_kPa;
    for (ForceEstimate& other : estimate.further)
      if (other.in_contact) other.max_von_mises_kPa = max_kPa;
  }
};

ForceEstimator::ForceEstimator(TissueMap map, const StereoFrame& static_frame, const Rectification& rectification,
                               const InstrumentOptions& instrument, const ContactOptions& contact,
                               const InferenceParameters& tuning, ForceUncertainty uncertainty)
    : state_(std::make_unique<State>(std::move(map), rectify(rectification, static_frame), rectification, instrument,
                                     contact, tuning, std::move(uncertainty))) {}
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
  estimate.status = FrameStatus::tool_lost;
  if (s.map.tissue.modulus_unknown) estimate.warnings.push_back("modulus_unknown");
  estimate.further.resize(kMaxInstruments - 1, estimate);
  const auto of = [&estimate](size_t instrument) -> ForceEstimate& {
    return instrument == 0 ? estimate : estimate.further[instrument - 1];
  };
  if (frame.left.empty() || frame.right.empty()) {
    for (size_t i = 0; i < kMaxInstruments; ++i) of(i).warnings.push_back("camera_missing");
    return estimate;
  }

  Stopwatch watch;
  const RectifiedPair pair = rectify(s.rectification, frame);
  const PictureQuality quality = s.pictures.update(pair.left, pair.right);
  estimate.times.rectify_ms = watch.lap_ms();

  const InstrumentObservations instruments = s.instruments.update(pair);
  estimate.left_instrument_mask = instruments.left_mask;
  const bool after_map = frame.index > s.map.frame;
  if (after_map) s.touchable.look(instruments.left_mask);
  FrameEvidence evidence;
  evidence.time_s = frame.time_s;
  evidence.tips = instruments.tips;
  evidence.may_touch = after_map && !quality.repeated;
  if (frame.index >= s.held_from_frame) evidence.held_at_mm = s.held_at_mm;
  evidence.held_for_sure = frame.index == s.held_from_frame;
  evidence.may_be_held = [&s](const Vec3& place_mm) { return s.touchable.may_be_held(place_mm); };
  std::vector<TissuePoint> wanted;
  if (after_map) {
    wanted = s.filter.wanted_points();
    evidence.tissue = s.tissue.update(pair, instruments.left_mask, instruments.right_mask, wanted);
  }
  estimate.times.track_ms = watch.lap_ms();

  const auto found = static_cast<double>(evidence.tissue.size()), asked = static_cast<double>(wanted.size());
  const bool obscured = quality.obscured && found < s.tuning.min_points_obscured * asked;
  FrameAnswer answer;
  if (after_map && !obscured) answer = s.filter.update(evidence);
  if (after_map && found < s.tuning.min_points * asked) answer.explained = false;
  estimate.times.solve_ms = watch.lap_ms();

  for (size_t i = 0; i < kMaxInstruments; ++i) {
    if (answer.instruments[i].begins) s.instruments.mark(i);
    if (instruments.eyes_out_of_step) of(i).warnings.push_back("eyes_out_of_step");
    if (obscured) continue;
    if (!answer.instruments[i].is_kept) s.instruments.unmark(i);
    if (!after_map) answer.instruments[i].tip_mm = instruments.tips[i].tip_mm;
    const bool is_told = i == 0 && s.held_at_mm;
    if (is_told && answer.instruments[i].hold == Hold::free)
      answer.instruments[i].tip_mm = answer.scene.apply(*s.held_at_mm);
    s.report(answer.instruments[i], answer, is_told || instruments.tips[i].visible, of(i));
    of(i).tip_velocity_mm_per_s = instruments.tips[i].velocity_mm_per_s;
    of(i).scene_mm = answer.scene.translation_mm;
  }
  if (answer.equilibrium) s.show(answer, estimate);
  estimate.times.stress_ms = watch.lap_ms();
  for (ForceEstimate& other : estimate.further) other.times = estimate.times;
  s.filter.look_ahead();
  return estimate;
}

}  // namespace palpate
