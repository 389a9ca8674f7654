#pragma once

#include <filesystem>
#include <memory>
#include <optional>

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
  std::filesystem::path calibration;
  TranslationUnit translation_unit = TranslationUnit::detect;
  double fps = 0;  ///< 0 = as the file says
};

void describe(Settings& settings, RecordingOptions& options);

/// Frames of a stereo recording, one after the other. Video files, image patterns (left_%04d.png), device numbers and
/// GStreamer pipelines, as OpenCV opens them.
class Recording {
 public:
  /// Throws BadInput: missing or empty video, left and right of different size or length by their headers.
  explicit Recording(const RecordingOptions& options);
  ~Recording();
  Recording(Recording&&) noexcept;

  /// The next frame, or nothing at the end. Throws Unfinished when the video ends before the length its header states.
  std::optional<StereoFrame> next();

  cv::Size size() const;    ///< of one eye, px
  double fps() const;       ///< frames per second
  int frame_count() const;  ///< by the header; -1 when unknown (live sources)

 private:
  struct Sources;
  std::unique_ptr<Sources> sources_;
};

}  // namespace palpate
