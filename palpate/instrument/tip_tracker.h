#pragma once

#include <array>
#include <optional>

#include "palpate/instrument/instrument_tracker.h"
#include "palpate/instrument/rigid_motion.h"
#include "palpate/instrument/stereo_synchronization.h"
#include "palpate/instrument/tip_filter.h"
#include "palpate/instrument/tip_track.h"

namespace palpate {

/// What one camera sees of one instrument in one frame.
struct CameraView {
  cv::Mat mask;                 ///< 255 = this instrument, of the whole image
  std::optional<ImageTip> tip;  ///< nothing when the mask shows none
  ImageLayers layers;           ///< around the tip, or around where it was last
};

/// The part of the image around a tip in which TipTracker looks.
cv::Rect region_around(const ImageTip& tip);

/// Whether two tips can be the same one seen by the left and the right camera.
bool can_be_one_tip(const ImageTip& left, const ImageTip& right);

/// Follows one instrument in 3D, told where it is in each image: Lucas-Kanade against a keyframe, epipolar match,
/// triangulation, Kalman filter.
class TipTracker {
 public:
  TipTracker(const Rectification& rectification, const RowOffset& rows) : rectification_(rectification), rows_(rows) {}

  /// `seconds` since the last frame, `index` of this one. `touches_another`: the masks do not tell where this one ends,
  /// so that its texture has to be trusted for longer.
  TipObservation update(const CameraView& left, const CameraView& right, int index, double seconds,
                        bool touches_another);

  /// The same from a row of a tip track, if there is one for this frame.
  TipObservation update(const std::optional<TipTrack::Row>& row);

  /// Takes the frame of the last update as the zero of `since_mark_mm`.
  void mark();
  void unmark();

  bool visible() const { return visible_; }
  bool marked() const { return marked_; }
  bool eyes_out_of_step() const { return out_of_step_; }
  /// In the left (0) or right (1) image, as last seen.
  const std::optional<ImageTip>& last_tip(size_t camera) const { return last_tips_[camera]; }
  /// Where the visible tip is expected in an image after `seconds`.
  cv::Point2d expected_px(size_t camera, double seconds) const;

 private:
  struct Detection;
  std::optional<Detection> detect(const CameraView& left, const CameraView& right) const;
  std::optional<RigidMotion> motion_since_keyframe(const CameraView& left, const CameraView& right,
                                                   const std::optional<Detection>& detection, double seconds) const;
  Mat3 step_covariance(const RigidMotion& motion) const;
  bool advance(const std::optional<RigidMotion>& measured, bool followed, const std::optional<Detection>& detection,
               double seconds);
  void renew_keyframe(std::optional<Detection> detection, const CameraView& right);
  void use_fresh_keyframe();
  void lose();
  void report_since_mark(TipObservation& observation) const;

  Rectification rectification_;
  RowOffset rows_;
  TipFilter filter_;
  StereoSynchronization synchronization_;
  bool out_of_step_ = false;                          // as last found; it stays so while nothing moves
  std::array<std::optional<ImageTip>, 2> last_tips_;  // where to look when a mask shows none
  std::optional<InstrumentPlane> last_plane_;         // of the last detection
  std::optional<InstrumentKeyframe> keyframe_;
  std::optional<InstrumentKeyframe> fresh_keyframe_;  // of the last frame, should it be marked
  RigidMotion motion_;                                // since the keyframe, as last measured
  int frames_alone_ = 0;
  int rejected_ = 0;
  bool visible_ = false;

  bool marked_ = false;
  std::optional<TipTrack::Row> last_row_;      // with a track
  std::optional<RigidMotion> motion_at_mark_;  // since the keyframe; none when the mark came without a keyframe
  Vec3 tip_at_mark_mm_ = Vec3::Zero();         // rectified frame, or left camera frame with a track
  Mat3 covariance_at_mark_mm2_ = Mat3::Zero();
};

}  // namespace palpate
