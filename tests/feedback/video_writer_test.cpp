#include "palpate/feedback/video_writer.h"

#include <opencv2/videoio.hpp>
#include <optional>
#include <stdexcept>

#include "palpate/core/errors.h"
#include "tests/feedback/temporary_folder.h"

namespace palpate {
namespace {

constexpr int kFrames = 30;
const cv::Size kSize(192, 108);

cv::Mat grey(int frame) {
  return {kSize, CV_8UC3, cv::Scalar::all(20 + 7 * frame)};
}

class Video : public test::TemporaryFolder {
 protected:
  /// Mean brightness of each frame of the file.
  std::vector<double> brightness() const {
    cv::VideoCapture reader(file("overlay.mp4").string());
    std::vector<double> values;
    for (cv::Mat image; reader.read(image);) values.push_back(cv::mean(image)[1]);
    return values;
  }
};

TEST_F(Video, HoldsEveryFrameInOrder) {
  VideoWriter writer(file("overlay.mp4"), 25, kSize);
  for (int i = 0; i < kFrames; ++i) writer.write(grey(i));
  writer.finish();
  const std::vector<double> values = brightness();
  ASSERT_EQ(values.size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) EXPECT_NEAR(values[static_cast<size_t>(i)], 20 + 7 * i, 4) << "frame " << i;
}

TEST_F(Video, StaysReadableWhenTheRunEndsEarly) {
  try {
    VideoWriter writer(file("overlay.mp4"), 25, kSize);
    for (int i = 0; i < 11; ++i) writer.write(grey(i));
    throw Unfinished("the recording ends early");
  } catch (const Unfinished&) {
  }
  EXPECT_EQ(brightness().size(), 11u);
}

TEST_F(Video, CannotBeginInAFolderThatDoesNotExist) {
  EXPECT_THROW(VideoWriter(file("nowhere") / "overlay.mp4", 25, kSize), Unfinished);
}

TEST_F(Video, SaysWhenFramesAreMissingInTheEnd) {
  VideoWriter writer(file("overlay.mp4"), 25, kSize);
  for (int i = 0; i < kFrames; ++i) writer.write(grey(i));
  std::filesystem::remove(file("overlay.mp4"));
  EXPECT_THROW(writer.finish(), Unfinished);
}

TEST_F(Video, RefusesAFrameOfAnotherSize) {
  VideoWriter writer(file("overlay.mp4"), 25, kSize);
  EXPECT_THROW(writer.write(cv::Mat(54, 96, CV_8UC3)), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
