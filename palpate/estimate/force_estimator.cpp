#include "palpate/estimate/force_estimator.h"

#include <algorithm>
#include <utility>

#include "palpate/core/stopwatch.h"
#include "palpate/elastic/stress.h"
#include "palpate/infer/band.h"
#include "palpate/infer/force_filter.h"
#include "palpate/observe/picture_quality.h"
#include "palpate/observe/tissue_tracker.h"

namespace palpate {

namespace {

/// Fraction of the tissue points below which an obscured picture shows nothing, and a clear one another scene.
constexpr double kMinPointsObscured = 0.6, kMinPoints = 0.25;
/// A hidden tip's force is told where its deviation is below this ratio of it.
constexpr double kTellingDeviation = 0.4;

AttachedMesh attached(const TissueMap& map, const Rectification& rectification, TetMesh mesh) {
  std::vector<int> fixed = select_attachments(mesh, map.attachments, [&rectification](const Vec3& point) {
    return project_to_recorded_left(rectification.rig, point);
  });
  return {std::move(mesh), std::move(fixed)};
}

/// The map, finer around the places that are held: edges of the stated radius about the patch, of half of it beneath.
ContactModel::MeshAround refined_around(const TissueMap& map, const Rectification& rectification, double radius_mm) {
  return [map, rectification, radius_mm](const std::vector<Vec3>& places_mm) {
    TetMesh mesh = map.mesh;
    for (const Vec3& place_mm : places_mm) {
      mesh = refine_near(mesh, place_mm, 1.5 * radius_mm, radius_mm);
      mesh = refine_near(mesh, place_mm, 0.7 * radius_mm, 0.6 * radius_mm);
    }
    return attached(map, rectification, std::move(mesh));
  };
}

}  // namespace

struct ForceEstimator::State {
  TissueMap map;
  Rectification rectification;
  InferenceParameters tuning;
  double radius_mm;
  InstrumentTracker instruments;
  PictureWatch pictures;
  TissueTracker tissue;
  ForceFilter filter;

  State(TissueMap m, const RectifiedPair& rest, const Rectification& r, const InstrumentOptions& instrument,
        const ContactOptions& contact, const InferenceParameters& t)
      : map(std::move(m)),
        rectification(r),
        tuning(t),
        radius_mm(contact.footprint_radius_mm),
        instruments(instrument, r, rest, map.organ_mask),
        pictures(rest.left),
        tissue(rest, r, map.disparity.disparity_px, map.organ_mask & r.valid_left),
        filter(ContactModel(refined_around(map, r, radius_mm), map.tissue, map.element), {map.mesh, map.fixed_nodes},
               tissue.points(), r, contact, t) {}

  /// One row of forces.csv.
  void report(const InstrumentAnswer& answer, const FrameAnswer& whole, bool tip_visible, ForceEstimate& estimate) {
    estimate.tip_mm = answer.tip_mm;
    estimate.grip = answer.hold;
    estimate.p_contact = answer.p_contact;
    estimate.misfit_mm = answer.misfit_mm;
    estimate.in_contact = answer.hold != Hold::free;
    estimate.status = tip_visible ? FrameStatus::no_contact : FrameStatus::tool_lost;
    estimate.footprint_mm = radius_mm;
    estimate.band = {0, unnoticed_force_N(map.tissue, radius_mm, tuning)};
    if (!estimate.in_contact) {
      if (tip_visible && !whole.explained) estimate.status = FrameStatus::map_stale;
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
    estimate.mean_nodal_force_N = answer.mean_nodal_force_N;
    estimate.band = force_band(answer.force_N, answer.force_covariance_N2);
    estimate.status = whole.explained ? FrameStatus::ok : FrameStatus::map_stale;
    const double half_width_N = 0.5 * (estimate.band.high_N - estimate.band.low_N);
    if (!answer.tip_inferred || half_width_N < 2 * kTellingDeviation * estimate.force_N.norm()) return;
    estimate.status = FrameStatus::tool_lost;
    estimate.in_contact = false;
    estimate.force_N.setZero();
    estimate.mean_nodal_force_N = 0;
  }

  /// The deformed surface for drawing, where it lies now, and its stress.
  void show(const FrameAnswer& answer, ForceEstimate& estimate) const {
    const TetModel& model = filter.model().model();
    const Eigen::VectorXd& u = answer.equilibrium->u;
    estimate.boundary = filter.model().boundary();
    estimate.deformed_nodes_mm = model.rest_mm();
    for (size_t n = 0; n < estimate.deformed_nodes_mm.size(); ++n) {
      Vec3& node = estimate.deformed_nodes_mm[n];
      node = answer.scene.apply(node + u.segment<3>(3 * static_cast<Eigen::Index>(n)));
    }
    estimate.node_von_mises_kPa = node_von_mises_kPa(model, u);
    const double max_kPa = *std::max_element(estimate.node_von_mises_kPa.begin(), estimate.node_von_mises_kPa.end());
    if (estimate.in_contact) estimate.max_von_mises_kPa = max_kPa;
    for (ForceEstimate& other : estimate.further)
      if (other.in_contact) other.max_von_mises_kPa = max_kPa;
  }
};

ForceEstimator::ForceEstimator(TissueMap map, const StereoFrame& static_frame, const Rectification& rectification,
                               const InstrumentOptions& instrument, const ContactOptions& contact,
                               const InferenceParameters& tuning)
    : state_(std::make_unique<State>(std::move(map), rectify(rectification, static_frame), rectification, instrument,
                                     contact, tuning)) {}
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
  estimate.further.resize(kMostInstruments - 1, estimate);
  const auto of = [&estimate](size_t instrument) -> ForceEstimate& {
    return instrument == 0 ? estimate : estimate.further[instrument - 1];
  };
  if (frame.left.empty() || frame.right.empty()) {
    for (size_t i = 0; i < kMostInstruments; ++i) of(i).warnings.push_back("camera_missing");
    return estimate;
  }

  Stopwatch watch;
  const RectifiedPair pair = rectify(s.rectification, frame);
  const PictureQuality quality = s.pictures.update(pair.left, pair.right);
  estimate.times.rectify_ms = watch.lap_ms();

  const InstrumentObservations instruments = s.instruments.update(pair);
  estimate.left_instrument_mask = instruments.left_mask;
  const bool after_map = frame.index > s.map.frame;
  FrameEvidence evidence{frame.time_s, {}, instruments.tips, after_map && !quality.repeated};
  std::vector<TissuePoint> wanted;
  if (after_map) {
    wanted = s.filter.wanted_points();
    evidence.tissue = s.tissue.update(pair, instruments.left_mask, instruments.right_mask, wanted);
  }
  estimate.times.track_ms = watch.lap_ms();

  const auto found = static_cast<double>(evidence.tissue.size()), asked = static_cast<double>(wanted.size());
  const bool obscured = quality.obscured && found < kMinPointsObscured * asked;
  FrameAnswer answer;
  if (after_map && !obscured) answer = s.filter.update(evidence);
  if (after_map && found < kMinPoints * asked) answer.explained = false;
  estimate.times.solve_ms = watch.lap_ms();

  for (size_t i = 0; i < kMostInstruments; ++i) {
    if (answer.instruments[i].begins) s.instruments.mark(i);
    if (instruments.eyes_out_of_step) of(i).warnings.push_back("eyes_out_of_step");
    if (obscured) continue;
    if (!after_map) answer.instruments[i].tip_mm = instruments.tips[i].tip_mm;
    s.report(answer.instruments[i], answer, instruments.tips[i].visible, of(i));
    of(i).scene_mm = answer.scene.translation_mm;
  }
  if (answer.equilibrium) s.show(answer, estimate);
  estimate.times.stress_ms = watch.lap_ms();
  for (ForceEstimate& other : estimate.further) other.times = estimate.times;
  return estimate;
}

}  // namespace palpate
