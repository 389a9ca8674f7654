#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/instrument/find_tip.h"
#include "palpate/instrument/hand_eye.h"
#include "palpate/instrument/segmentation_network.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// Instruments that are kept apart.
inline constexpr size_t kMaxInstruments = 2;

/// `instrument` of the scene file.
struct InstrumentOptions {
  std::filesystem::path segmentation = "learned";  ///< learned, colour, none (in no image) or the user's network
  NetworkOptions network;                          ///< of the user's network
  std::vector<cv::Point2d> example_px;             ///< outline of an instrument's shaft, left image as recorded
  int at_frame = 0;                                ///< in which the example lies
  std::filesystem::path track;                     ///< tip.csv instead of the images
  std::filesystem::path track_2;                   ///< the same for the second instrument
  CameraFromRobot camera_from_robot;               ///< axes of the tracks
  double time_offset_s = 0;                        ///< track time minus video time; 0: rows are found by frame number
  /// Of a live track (`track: openigtlink:...`): the tip now, left camera frame; nothing while none is known. Set by
  /// who listens to it.
  std::function<std::optional<TipTrack::Row>()> live_tip;

  bool has_live_track() const { return track.string().starts_with("openigtlink:"); }
};

void describe(Settings& settings, InstrumentOptions& options);

/// What one frame says about the tip of one instrument, left camera frame.
struct TipObservation {
  bool visible = false;
  Vec3 tip_mm = Vec3::Zero();  ///< far end of the jaws; filtered
  Mat3 covariance_mm2 = Mat3::Identity();
  Vec3 velocity_mm_per_s = Vec3::Zero();
  std::optional<Vec3> since_mark_mm;  ///< displacement since `mark`, better known than the tip itself
  Mat3 since_mark_covariance_mm2 = Mat3::Identity();
  bool is_seen = true;                              ///< by the cameras, whose disparity limits its depth; else told
  std::optional<bool> closed;                       ///< jaws hold, where a tip track says so
  std::array<std::optional<ImageTip>, 2> in_image;  ///< where the masks end, rectified left and right image
};

/// What one frame says about all instruments.
struct InstrumentObservations {
  std::vector<TipObservation> tips;  ///< always kMaxInstruments; an entry stays the same instrument
  cv::Mat left_mask;                 ///< 255 = any instrument, rectified left image
  cv::Mat right_mask;
  bool eyes_out_of_step = false;  ///< the cameras show different moments: whatever moves is misplaced
};

/// p of the paper, for each instrument: segmentation, tip in both images, pyramidal Lucas-Kanade between frames,
/// epipolar match, triangulation, Kalman filter. The first entry is the instrument that was seen first (at the same
/// time: the one that covers more of the picture). One that was followed for a while keeps its entry for when it comes
/// back from where it left; what enters from elsewhere gets a free entry. While two touch in the picture, each is
/// followed by its texture alone or is not visible.
class InstrumentTracker {
 public:
  /// `static_frame`: the rectified pair of the map frame; `organ_mask`: 255 = surely tissue in its left image. Throws
  /// BadInput when a tip track cannot be read.
  InstrumentTracker(const InstrumentOptions& options, const Rectification& rectification,
                    const RectifiedPair& static_frame, const cv::Mat& organ_mask);
  ~InstrumentTracker();
  InstrumentTracker(InstrumentTracker&&) noexcept;

  /// Frames in order of time. A tip that cannot be found is `visible = false`, never a guess.
  InstrumentObservations update(const RectifiedPair& pair);

  /// Takes the frame of the last update as the zero of `since_mark_mm` of one instrument (onset of a contact).
  void mark(size_t instrument);
  void unmark(size_t instrument);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
