#pragma once

#include <optional>
#include <vector>

#include "palpate/contact/contact_model.h"
#include "palpate/infer/map_estimate.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/observe/tissue_tracker.h"

namespace palpate {

/// A point of the tissue as a place of the body's surface.
struct SurfacePlace {
  Triangle nodes = {};
  Vec3 barycentric = Vec3::Zero();
  bool on_body = false;  ///< near enough to the surface to move with it
};

/// The place of each point on the body.
std::vector<SurfacePlace> places_of(const std::vector<TissuePoint>& points, const std::vector<Vec3>& nodes_mm,
                                    const std::vector<Triangle>& boundary);

/// Where a patch is laid and where its tip is seen, for the model's error around it.
struct PatchReach {
  Vec3 center_mm = Vec3::Zero();              ///< at rest
  double radius_mm = 0;                       ///< of the patch
  std::optional<Vec3> tip_mm = std::nullopt;  ///< as measured, left camera frame; nothing where it is not seen
  Vec3 tip_offset_mm = Vec3::Zero();          ///< of the tip from the middle of the patch, as believed before
};

/// What a measurement is compared with: the body as a response to first order, or at rest where `response` is null.
struct PredictedBody {
  const ContactResponse* response = nullptr;
  const std::vector<SurfacePlace>* places = nullptr;  ///< by number of the point
  Eigen::VectorXd x0;                                 ///< unknowns at which the response was computed
  Vec3 about_mm = Vec3::Zero();                       ///< of the scene's motion
  const std::vector<PatchReach>* patches = nullptr;   ///< where the model is right; nullptr = everywhere alike

  /// Displacement of a point at x0, mm; its derivative by the displacement of one patch.
  Vec3 displacement_mm(const TissuePoint& point) const;
  Mat3 motion_by(const TissuePoint& point, size_t contact) const;
};

/// Left x, left y and disparity of a rectified point; its derivative by the point, left camera frame.
struct StereoProjection {
  Vec3 px;
  Mat3 per_mm;
};
StereoProjection project_stereo(const Rectification& rectification, const Vec3& point_mm);

/// Error of where the model says that a point is, mm: a ratio of how far a half-space would move it, |q| r / distance,
/// where |q| is at least what the tip tells: else a small q would make the tissue's word for it the surer. What is not
/// known of the body (Saint-Venant) moves far tissue about as much as near, where Eq. 3 nearly cancels.
double model_error_mm(const TissuePoint& point, const PredictedBody& body, const InferenceParameters& parameters);

/// Tissue points in both cameras: z = pi(S (X + u)) - pi(X) + bias, px.
std::vector<Measurement> tissue_measurements(const std::vector<TissuePoint>& seen, const PredictedBody& body,
                                             const Rectification& rectification, const InferenceParameters& parameters);

/// Covariance of a tip's displacement that no tracker knows better than this, mm2: that of a tip which the cameras see
/// is far less sure along the viewing ray than across it; a robot's is not.
Mat3 tip_floor_covariance_mm2(const TipObservation& tip, const Rectification& rectification,
                              const InferenceParameters& parameters);

/// The tip: z = S (X_c + q + offset), mm. `center_mm`: of the patch at rest.
Measurement tip_measurement(const Vec3& tip_mm, const Mat3& covariance_mm2, size_t contact, const Vec3& center_mm,
                            const PredictedBody& body, const InferenceParameters& parameters);

/// Motion expected of every point, px, for the tracker's search.
std::vector<Vec3> expected_motion_px(const std::vector<TissuePoint>& points, const PredictedBody& body,
                                     const Rectification& rectification);

}  // namespace palpate
