#pragma once

#include <future>
#include <optional>
#include <vector>

#include "palpate/contact/gap.h"
#include "palpate/infer/contact_fit.h"
#include "palpate/infer/force_filter.h"

namespace palpate {

/// Where a touch may have gone by unnoticed; in the map frame.
struct PassedTouch {
  Vec3 place_mm = Vec3::Zero();  ///< of the surface, at rest
  Vec3 tip_mm = Vec3::Zero();
  double log_odds = 0;  ///< that it touched
  double time_s = 0;
};

/// How far a tissue point is from its prediction.
struct PointMisfit {
  double mm = 0;  ///< across the viewing ray
  bool explained = true;
};

/// What is kept of one instrument.
struct Hand {
  explicit Hand(Grip grip) : filter(grip) {}
  HoldFilter filter;
  std::optional<size_t> contact;       ///< its number in the model
  Vec3 tip_at_mark_mm = Vec3::Zero();  ///< left camera frame
  std::optional<Vec3> last_tip_mm;     ///< in the map frame
  std::optional<Vec3> released_at_mm;  ///< in the map frame, until it has left
  std::optional<bool> was_closed;
  bool is_felt = false;      ///< its force has been told from none
  bool is_confirmed = true;  ///< the tissue of a later frame has said that it holds
  bool is_told = false;      ///< the operator says where it holds; there is no tip
  double onset_s = 0;
  int frames_expected = 0;            ///< until a touch elsewhere may be expected
  std::optional<PassedTouch> passed;  ///< the most probable one since the tip was last out of reach
  double looked_back_s = 0;           ///< when a contact was last begun there
  SceneMotion free_scene;             ///< while a contact is kept that is more probably none
  Vec3 slid_from_mm = Vec3::Zero();   ///< the offset with which the patch was laid
  int laid_anew = 0;                  ///< times in a row that the patch was laid anew for what its pose says
  Vec3 learned_at_mm = Vec3::Zero();  ///< q of the last frame that the slow unknowns were learned from
};

/// A frame's answer from which radius and place of these instruments' patches are to be laid anew.
struct Renewal {
  Belief prior;
  FrameData data;
  ContactFit fit;
  std::vector<size_t> instruments;
};

/// What ForceFilter keeps from frame to frame, and the steps of a frame.
struct FilterState {
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
  std::optional<Renewal> renewal;   ///< left to `look_ahead`
  bool has_looked_ahead = true;     ///< since the last frame
  std::future<void> ahead;          ///< the last one: nothing else may be touched until it has ended

  FilterState(ContactModel m, const AttachedMesh& map, std::vector<TissuePoint> p, const Rectification& r,
              const ContactOptions& o, const InferenceParameters& q);

  /// Where the tip stands against the patch is told by the tissue that rests as yet, whatever drives later.
  FitContext context() const;
  double stated_log_radius() const;
  /// The patches as they are laid.
  std::vector<PatchReach> reaches() const;
  /// Tissue nearer to a patch than this moves with it, whatever the model says.
  double excluded_mm(size_t contact) const;
  /// The points on the body that no patch's rim disturbs; the same for every hypothesis of the frame.
  std::vector<TissuePoint> usable(const std::vector<TissuePoint>& seen) const;
  /// The body under its contacts, at rest: after the mesh has changed.
  void solve_anew();
  /// Of the force, N2: from the images and from the model's form.
  Mat3 force_covariance(const ForceAt& at, const ContactFit& fit) const;
  /// The tip as a measurement of its patch; nothing where it is not seen.
  std::optional<ContactTip> contact_tip(const Hand& hand, const TipObservation& tip) const;

  // touch.cpp: where contacts begin and end
  /// The contact begins where the operator says; whether it holds is for the tissue to tell.
  void begin_told(size_t instrument, const FrameEvidence& frame);
  /// Where a tip without contact stands against the surface, and whether it touches.
  void look_for_touch(size_t instrument, const FrameEvidence& frame, double seconds, InstrumentAnswer& answer);
  void release(size_t instrument, const Belief& without);

  // score_holds.cpp: which hypothesis explains the frame
  /// Every hypothesis of one contact on the same data; the contact may end, or slide on.
  void score_holds(size_t instrument, const Belief& prior, const FrameData& data, const TipObservation& tip,
                   ContactFit& tied);

  // renew_patch.cpp: radius and place of the patch
  /// Radius and place of the patch as believed by now. A weak force, or tissue that a tip may slide over, says nothing
  /// of the radius.
  void renew_patch(size_t instrument, const Belief& prior, const FrameData& data, const ContactFit& fit);

  void look_ahead();
  void finish_look_ahead();

  // answer.cpp: what is told of a frame
  void report(size_t instrument, const ContactFit& fit, const TipObservation& tip, InstrumentAnswer& answer) const;
  /// Median distance between where tissue is seen and where it is predicted, across the viewing ray, mm; and whether it
  /// is explained.
  double misfit_mm(const FrameData& data, const Belief& at, bool& explained) const;

 private:
  /// The patch with another radius, as far on the way to it as the frame is better explained.
  void lay_anew(size_t contact, double log_radius, const Belief& prior, const FrameData& data, double log_evidence);
  /// The patch where the tip has slid to.
  void follow_slide(size_t instrument);
  /// Has the body made ready for where a free tip is about to touch.
  void expect_touch(Hand& hand, const Gap& gap, const Vec3& step_mm, const Vec3& tip_mm);
  Gap gap_of(const Vec3& tip_in_map_mm) const;
  Vec3 place_at_rest(const Gap& gap) const;
  ContactPrior prior_of_touch() const;
  /// Of a tip that has displaced the tissue by about q before it was noticed.
  ContactPrior prior_of_unnoticed_touch(const Vec3& q_mm) const;
  void begin_at(size_t instrument, const Vec3& place_mm, const ContactPrior& prior);
  /// The contact begins at this place of the surface, and from now on the tip counts from here.
  void begin(size_t instrument, const TipObservation& tip, const Vec3& place_mm, const ContactPrior& prior);
  /// Keeps where the tip most probably touched.
  void remember_touch(Hand& hand, const Gap& gap, const Vec3& tip_mm, double log_odds) const;
  /// A touch that went by unnoticed begins where it was when the tissue around is moved by something.
  void look_back(size_t instrument, const FrameEvidence& frame, const Vec3& tip_mm, InstrumentAnswer& answer);
  std::vector<PointMisfit> misfits(const std::vector<TissuePoint>& tissue, const Belief& at) const;
  /// log p(tip | free) in the map frame; nothing where there is no tip.
  double log_free_tip(size_t instrument, const TipObservation& tip, const Belief& free, double seconds) const;
  double force_per_mm(size_t contact) const;
  /// A sliding tip is anywhere along the surface; its force lies on the edge of the cone.
  ContactFit fit_sliding(const Belief& prior, const FrameData& data, size_t contact) const;
  bool is_near_its_patch(const TipObservation& tip, const Belief& free, size_t contact) const;
  ContactFit free_of(const Belief& prior, const FrameData& data, size_t contact);
};

}  // namespace palpate
