#include "palpate/feedback/video_writer.h"

#include <fmt/format.h>

#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <system_error>

#include "palpate/core/errors.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {
namespace {

/// Below this the encoder's next write may be lost without a word: OpenCV reports no error of a single frame.
constexpr std::uintmax_t kLeastFreeSpace_bytes = 1 << 20;
constexpr int kFramesBetweenChecks = 25;

}  // namespace

struct VideoWriter::State {
  std::filesystem::path file;
  cv::Size size;
  cv::VideoWriter writer;
  int frames = 0;

  void check_free_space() const {
    std::error_code error;
    const std::filesystem::space_info space =
        std::filesystem::space(std::filesystem::absolute(file).parent_path(), error);
    if (!error && space.available < kLeastFreeSpace_bytes)
      throw Unfinished(fmt::format("cannot go on writing {}: the disk is full", file.string()));
  }
};

VideoWriter::VideoWriter(const std::filesystem::path& file, double fps, const cv::Size& size)
    : state_(std::make_unique<State>()) {
  state_->file = file;
  state_->size = size;
  state_->check_free_space();
  const QuietOpenCv quiet;
  for (const char* codec : {"avc1", "mp4v"}) {
    const int fourcc = cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]);
    if (state_->writer.open(file.string(), cv::CAP_FFMPEG, fourcc, fps, size)) return;
  }
  throw Unfinished(fmt::format("cannot write {}: no video encoder opens it", file.string()));
}

VideoWriter::~VideoWriter() = default;
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;

void VideoWriter::write(const cv::Mat& bgr) {
  if (bgr.size() != state_->size || bgr.type() != CV_8UC3)
    throw std::invalid_argument("VideoWriter::write: the image is not an 8-bit BGR image of the video's size");
  if (state_->frames % kFramesBetweenChecks == 0) state_->check_free_space();
  state_->writer.write(bgr);
  ++state_->frames;
}

void VideoWriter::finish() {
  state_->writer.release();
  const QuietOpenCv quiet;
  const cv::VideoCapture reader(state_->file.string(), cv::CAP_FFMPEG);
  const int frames = reader.isOpened() ? static_cast<int>(reader.get(cv::CAP_PROP_FRAME_COUNT)) : 0;
  if (frames < state_->frames)
    throw Unfinished(
        fmt::format("{} holds {} of {} frames: is the disk full?", state_->file.string(), frames, state_->frames));
}

}  // namespace palpate
