#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// `instrument` of the scene file.
struct InstrumentOptions {
  std::string segmentation = "colour";  ///< how the instrument is found in the images
  std::filesystem::path track;          ///< tip.csv instead of the images
};

void describe(Settings& settings, InstrumentOptions& options);

/// What one frame says about the tip, left camera frame.
struct TipObservation {
  bool visible = false;
  Vec3 tip_mm = Vec3::Zero();  ///< far end of the jaws; filtered
  Mat3 covariance_mm2 = Mat3::Identity();
  Vec3 velocity_mm_per_s = Vec3::Zero();
  std::optional<Vec3> since_mark_mm;  ///< displacement since `mark`, better known than the tip itself
  Mat3 since_mark_covariance_mm2 = Mat3::Identity();
  std::optional<bool> closed;  ///< jaws hold, where a tip track says so
  cv::Mat left_mask;           ///< 255 = instrument, rectified left image; empty with a tip track
  cv::Mat right_mask;
  bool eyes_out_of_step = false;  ///< the eyes show different moments: whatever moves is misplaced
};

/// p of the paper: segmentation, tip in both images, pyramidal Lucas-Kanade between frames, epipolar match,
/// triangulation, Kalman filter.
class TipTracker {
 public:
  /// `static_frame`: the rectified pair of the map frame; `organ_mask`: 255 = surely tissue in its left image.
  TipTracker(const InstrumentOptions& options, const Rectification& rectification, const RectifiedPair& static_frame,
             const cv::Mat& organ_mask);
  ~TipTracker();
  TipTracker(TipTracker&&) noexcept;

  /// Frames in order of time. A frame in which the tip cannot be found is `visible = false`, never a guess.
  TipObservation update(const RectifiedPair& pair);

  /// Takes the frame of the last update as the zero of `since_mark_mm` (onset of a contact).
  void mark();
  void unmark();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// tip.csv: frame,time_s,x_mm,y_mm,z_mm[,closed], left camera frame. Throws BadInput with file and line.
struct TipTrack {
  struct Row {
    double time_s = 0;
    Vec3 tip_mm = Vec3::Zero();
    std::optional<bool> closed;
  };
  std::map<int, Row> rows;  ///< by frame number
};
TipTrack read_tip_track(const std::filesystem::path& file);

}  // namespace palpate
