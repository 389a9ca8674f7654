#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>

namespace palpate {

/// Writes an MP4 (H.264, or MPEG-4 where the system has no encoder for it) of one fragment per frame: what is on the
/// disk plays, wherever the program ends. Of an odd width or height the last column or row is left out. A mebibyte of
/// the disk is left free for files that matter more.
class VideoWriter {
 public:
  /// Throws Unfinished when no encoder opens the file, or the disk is full.
  /// `quality_crf`: of x264, less is finer.
  VideoWriter(const std::filesystem::path& file, double fps, const cv::Size& size, int quality_crf = 23);
  ~VideoWriter();
  VideoWriter(VideoWriter&&) noexcept;

  /// 8-bit BGR of the size given at the start. Throws Unfinished when the disk is full, std::invalid_argument when the
  /// image has another size.
  void write(const cv::Mat& bgr);
  /// The same at a time of its own, counted from the first; times rise.
  void write(const cv::Mat& bgr, double time_s);

  /// Closes the file and checks that every frame is in it; throws Unfinished when not. Nothing can be written after.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
