#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>

namespace palpate {

/// Writes an MP4 (H.264, or MPEG-4 where the system has no encoder for it). The file is finished when the writer goes
/// away, also on the way out of an exception, so that what was written stays readable.
class VideoWriter {
 public:
  /// Throws Unfinished when no encoder opens the file.
  VideoWriter(const std::filesystem::path& file, double fps, const cv::Size& size);
  ~VideoWriter();
  VideoWriter(VideoWriter&&) noexcept;

  /// 8-bit BGR of the size given at the start. Throws Unfinished when the disk is full, std::invalid_argument when the
  /// image has another size.
  void write(const cv::Mat& bgr);

  /// Closes the file and checks that every frame is in it; throws Unfinished when not. Nothing can be written after.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
