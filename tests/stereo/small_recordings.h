#pragma once

#include <fmt/core.h>

#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "palpate/stereo/recording.h"
#include "tests/stereo/files.h"

namespace palpate::test {

constexpr int kLeftLevel = 60, kRightLevel = 180;

/// A grey image whose level tells the camera and whose bright bar tells the frame.
inline cv::Mat picture(cv::Size size, int level, int frame) {
  cv::Mat image(size, CV_8UC3, cv::Scalar::all(level));
  image(cv::Rect(0, 4 * (frame % 10), size.width, 4)) = cv::Scalar::all(250);
  return image;
}

inline void write_video(const std::filesystem::path& file, const std::vector<cv::Mat>& images, double fps = 25) {
  cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), fps, images.front().size());
  ASSERT_TRUE(writer.isOpened());
  for (const cv::Mat& image : images) writer.write(image);
}

inline std::vector<cv::Mat> camera(int level, int frames, cv::Size size = {64, 48}) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < frames; ++i) images.push_back(picture(size, level, i));
  return images;
}

/// Which of the frames have a right image: "1101", and their times in frames: "0,1,3".
inline std::pair<std::string, std::string> pairs_and_times(const RecordingOptions& options) {
  Recording recording(options);
  std::string pairs, times;
  while (const auto frame = recording.next()) {
    pairs += frame->right.empty() ? '0' : '1';
    times += fmt::format("{}{:.4g}", times.empty() ? "" : ",", frame->time_s * 25);
    EXPECT_EQ(frame->index + 1, static_cast<int>(pairs.size()));
  }
  return {pairs, times};
}

/// left.avi and right.avi, ten frames 40 ms apart, and what FFmpeg's own program makes of them.
class MadeByFfmpeg : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) GTEST_SKIP() << "the program ffmpeg is not installed";
    write_video(folder_ / "left.avi", camera(kLeftLevel, 10));
    write_video(folder_ / "right.avi", camera(kRightLevel, 10));
  }
  void make(const std::string& from, const std::string& options, const std::string& to,
            const std::string& of_input = "") const {
    const std::string command = fmt::format("ffmpeg -v error -y {} -i '{}' {} '{}'", of_input,
                                            (folder_ / from).string(), options, (folder_ / to).string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
  /// Every byte of one of the files.
  std::string read(const std::string& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  RecordingOptions options(const std::string& left, const std::string& right) const {
    RecordingOptions result;
    result.left = folder_ / left;
    result.right = folder_ / right;
    return result;
  }
  TemporaryFolder folder_;
};

}  // namespace palpate::test
