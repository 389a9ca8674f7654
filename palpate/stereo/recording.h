#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/stereo/rig.h"

namespace palpate {

enum class StereoLayout { side_by_side, top_bottom };

/// `recording` of the scene file: either left and right, or stereo with its layout.
struct RecordingOptions {
  std::filesystem::path left;
  std::filesystem::path right;
  std::filesystem::path stereo;
  StereoLayout layout = StereoLayout::side_by_side;
  bool swap = false;
  bool deinterlace = false;
  std::filesystem::path calibration;
  cv::Rect2d crop_px;  ///< of the calibrated images, what the recording shows; empty = all
  double scale = 1;    ///< size of the recorded images over that of the part that they show
  TranslationUnit translation_unit = TranslationUnit::detect;
  double fps = 0;  ///< 0 = as the file says
};

void describe(Settings& settings, RecordingOptions& options);

/// The rig of the recording's images: its calibration, cut and scaled as the options say. Throws BadInput.
StereoRig read_rig(const RecordingOptions& options);

/// What the time stamps of a recording say, before anything is decoded.
struct RecordingTiming {
  double rate_Hz = 0;          ///< of the left camera, 1 / usual step; 0 = not known (addresses, single images)
  double jitter_ms = 0;        ///< standard deviation of the steps that are no gaps
  int gaps = 0;                ///< steps of more than one and a half usual ones
  double longest_gap_s = 0;    ///< longest step
  double offset_ms = 0;        ///< right minus left, median over the pairs
  int left_without_right = 0;  ///< frames of the left camera, with an empty right image
  int right_without_left = 0;  ///< frames of the right camera that are left out
  bool is_live = false;        ///< the rate is the stated one, all else is not known
};

/// Frames of a stereo recording, one after the other: video files, image patterns (left_%04d.png, %04d/left.png, names
/// that are nanoseconds). A frame's time is its presentation stamp, counted from the first left one. Left and right are
/// paired by stamp, within half a frame; frames are those of the left camera, and where the right one has none, the
/// right image is empty.
///
/// Devices, GStreamer pipelines and rtsp:// addresses are live: each frame is the newest, and while both cameras are
/// silent there are frames without images.
class Recording {
 public:
  /// Throws BadInput: missing or empty video, live source that cannot be had, left and right of different size, no
  /// frame that both have.
  explicit Recording(const RecordingOptions& options);
  ~Recording();
  Recording(Recording&&) noexcept;

  /// The next frame, or nothing at the end. Throws Unfinished when a file is cut: its header states more than it holds.
  std::optional<StereoFrame> next();

  cv::Size size() const;    ///< of one camera, px
  double fps() const;       ///< frames per second, mean over the recording
  int frame_count() const;  ///< of the left camera; -1 when unknown (live sources)
  const RecordingTiming& timing() const;
  bool is_live() const;
  /// Steady clock, when the last frame of a live source was taken, by its stamp; 0 = not live.
  int64_t taken_ns() const;
  int dropped() const;  ///< frames of a live source in whose place a newer one was given
  /// Numbers, times and dropped frames of a live source count from its next frame on.
  void count_anew();
  /// Every frame of a live source from now on, from a thread of its own that must not wait; no function ends it. Their
  /// index is 0 and their time that of the steady clock.
  void listen(std::function<void(const StereoFrame&)> listener);
  /// Sentences about the files that a user ought to know: a varying rate, combed pictures, how left and right lie.
  const std::vector<std::string>& notes() const;
  /// Sentences about the frames so far that a decoder called damaged; what they show is guessed in part.
  std::vector<std::string> damages() const;

 private:
  struct Sources;
  std::unique_ptr<Sources> sources_;
};

/// "25.00 frames/s, jitter 0.1 ms, no gaps, right camera +0.0 ms"
std::string describe_timing(const RecordingTiming& timing);

}  // namespace palpate
