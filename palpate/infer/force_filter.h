#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "palpate/contact/contact_model.h"
#include "palpate/contact/contact_options.h"
#include "palpate/infer/belief.h"
#include "palpate/infer/contact_tangent.h"
#include "palpate/infer/correlation.h"
#include "palpate/infer/hold_filter.h"
#include "palpate/infer/hypotheses.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/observe/tissue_tracker.h"

namespace palpate {

/// What a frame shows.
struct FrameEvidence {
  double time_s = 0;
  std::vector<TissuePoint> tissue;
  std::vector<TipObservation> tips;  ///< of each instrument
  bool may_touch = true;             ///< the picture is new and comes after the map frame
  /// Where the first instrument, which is not looked for, may hold the tissue: place at rest; empty = nowhere.
  std::optional<Vec3> held_at_mm;
  bool held_for_sure = false;  ///< it does hold it, from this frame on
  /// Whether a contact may begin at a place at rest; empty = everywhere.
  std::function<bool(const Vec3& place_mm)> may_be_held;
};

/// What is believed of one instrument.
struct InstrumentAnswer {
  Hold hold = Hold::free;
  double p_contact = 0;
  bool begins = false;   ///< the contact begins in this frame
  bool is_kept = false;  ///< there is a contact, or one that has become improbable is kept in mind
  bool tip_inferred = false;
  bool converged = true;
  Vec3 tip_mm = Vec3::Zero();   ///< left camera frame: in contact the middle of the patch
  Vec3 force_N = Vec3::Zero();  ///< of the instrument on the tissue, left camera frame
  Mat3 force_covariance_N2 = Mat3::Zero();
  Vec3 place_mm = Vec3::Zero(), q_mm = Vec3::Zero();  ///< middle of the patch at rest, and how it is displaced
  ContactTangent tangent;
  ForceCorrelation correlation;
  double mean_nodal_force_N = 0;
  double footprint_mm = 0;
  double misfit_mm = 0;
  bool near_attachment = false;
  double stretch = 0;          ///< displacement of the patch over how far the attachments, or five radii, are
  bool is_off_limits = false;  ///< a contact would begin where none may
};

struct FrameAnswer {
  std::array<InstrumentAnswer, kMaxInstruments> instruments;
  SceneMotion scene;
  bool explained = true;  ///< some hypothesis explains the tissue that is seen
  /// The body under all contacts; empty where nothing touches.
  std::optional<Equilibrium> equilibrium;
};

struct FilterState;

/// The causal maximum a posteriori estimate around Eq. 3 (docs/inference.md): keeps what is believed of scene and
/// contacts from frame to frame.
class ForceFilter {
 public:
  /// `points`: every tissue point that may be seen; `map`: the body at rest.
  ForceFilter(ContactModel model, const AttachedMesh& map, std::vector<TissuePoint> points,
              const Rectification& rectification, const ContactOptions& contact,
              const InferenceParameters& parameters = {});
  ~ForceFilter();
  ForceFilter(ForceFilter&&) noexcept;

  /// The points to be followed in the next frame, evenly over the organ and closer around each contact, with the motion
  /// that is expected of them.
  std::vector<TissuePoint> wanted_points();

  /// Frames in order of time.
  FrameAnswer update(const FrameEvidence& frame);

  /// After `update`, in a thread of its own until the next frame comes: patches of another radius, the factor and its
  /// derivatives. Without it the next frame does that first; the answers are the same.
  void look_ahead();

  const ContactModel& model() const;

 private:
  std::unique_ptr<FilterState> state_;
};

}  // namespace palpate
