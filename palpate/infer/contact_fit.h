#pragma once

#include <optional>
#include <vector>

#include "palpate/infer/measurement.h"

namespace palpate {

/// A tip as measured while its contact lasts, left camera frame.
struct ContactTip {
  size_t contact = 0;
  Vec3 tip_mm = Vec3::Zero();
  Mat3 covariance_mm2 = Mat3::Identity();
};

/// What all hypotheses of a frame are weighed on.
struct FrameData {
  std::vector<TissuePoint> tissue;  ///< the points used
  std::vector<ContactTip> tips;
  double seconds = 0;  ///< since the last frame
};

/// What does not change from frame to frame.
struct FitContext {
  const Rectification& rectification;
  const InferenceParameters& parameters;
  Vec3 about_mm = Vec3::Zero();
  bool tissue_drives = true;  ///< false: the tip alone (contact.drive: tip)
  double stated_log_radius = 0;
  std::vector<PatchReach> patches = {};  ///< of each contact
};

/// Eq. 3 as last solved: the point around which a fit begins.
struct SolvedBody {
  ContactResponse response;
  std::vector<Vec3> q_mm;
  std::vector<double> log_radius;
  std::vector<SurfacePlace> places;  ///< by number of the point

  /// The unknowns at which the response holds, the rest as in `at`.
  Eigen::VectorXd unknowns(const Belief& at) const;
};

struct ContactFit {
  Belief posterior;  ///< of this frame, with all its correlations
  Belief kept;       ///< what the next frame begins with
  double log_evidence = 0;
  double chi2_ratio = 1;  ///< chi2 over degrees of freedom
  bool converged = true;
};

/// No contact: the scene's motion alone.
ContactFit fit_at_rest(const Belief& prior, const FrameData& data, const FitContext& context);

/// Around the body as it is, without solving it again. `further`: what a hypothesis adds.
ContactFit fit_linear(const Belief& prior, const FrameData& data, const SolvedBody& body, const ContactModel& model,
                      const FitContext& context, const std::vector<Measurement>& further = {});

/// Gauss-Newton: solves Eq. 3 where the last fit leads, into `body`, until q no longer moves.
ContactFit fit_contacts(const Belief& prior, const FrameData& data, SolvedBody& body, ContactModel& model,
                        const FitContext& context);

/// The body without the force of one contact, the others held where they are, to first order.
SolvedBody without_force(const SolvedBody& body, size_t contact);

/// Force of each contact at a belief near the solved body, N, and its derivative by the unknowns.
struct ForceAt {
  Vec3 force_N = Vec3::Zero();
  Eigen::MatrixXd per_unknown;  ///< 3 rows
};
ForceAt force_at(const SolvedBody& body, const Belief& belief, size_t contact);

}  // namespace palpate
