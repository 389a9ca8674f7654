#include "palpate/stereo/recording.h"

#include <fmt/core.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "tests/stereo/files.h"

namespace palpate {
namespace {

using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kLeftLevel = 60, kRightLevel = 180;

// A grey image whose level tells the eye and whose bright bar tells the frame.
cv::Mat picture(cv::Size size, int level, int frame) {
  cv::Mat image(size, CV_8UC3, cv::Scalar::all(level));
  image(cv::Rect(0, 4 * (frame % 10), size.width, 4)) = cv::Scalar::all(250);
  return image;
}

void write_video(const std::filesystem::path& file, const std::vector<cv::Mat>& images, double fps = 25) {
  cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), fps, images.front().size());
  ASSERT_TRUE(writer.isOpened());
  for (const cv::Mat& image : images) writer.write(image);
}

std::vector<cv::Mat> eye(int level, int frames, cv::Size size = {64, 48}) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < frames; ++i) images.push_back(picture(size, level, i));
  return images;
}

std::vector<cv::Mat> both_eyes(int frames, StereoLayout layout) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < frames; ++i) {
    cv::Mat both;
    const cv::Mat left = picture({64, 48}, kLeftLevel, i), right = picture({64, 48}, kRightLevel, i);
    layout == StereoLayout::side_by_side ? cv::hconcat(left, right, both) : cv::vconcat(left, right, both);
    images.push_back(both);
  }
  return images;
}

int level_of(const cv::Mat& image) {
  return image.at<cv::Vec3b>(image.rows - 2, image.cols / 2)[0];
}

void expect_eyes(const StereoFrame& frame, int left, int right, int index) {
  EXPECT_EQ(frame.left.size(), cv::Size(64, 48));
  EXPECT_EQ(frame.right.size(), cv::Size(64, 48));
  EXPECT_NEAR(level_of(frame.left), left, 6);
  EXPECT_NEAR(level_of(frame.right), right, 6);
  EXPECT_GT(frame.left.at<cv::Vec3b>(4 * index + 2, 32)[0], 225) << "frame " << index;
  EXPECT_EQ(frame.index, index);
}

void expect_all(const RecordingOptions& options, int frames, int left = kLeftLevel, int right = kRightLevel) {
  Recording recording(options);
  EXPECT_EQ(recording.size(), cv::Size(64, 48));
  EXPECT_EQ(recording.frame_count(), frames);
  for (int i = 0; i < frames; ++i) {
    const auto frame = recording.next();
    ASSERT_TRUE(frame.has_value());
    expect_eyes(*frame, left, right, i);
    EXPECT_NEAR(frame->time_s, i / recording.fps(), 1e-9);
  }
  EXPECT_FALSE(recording.next().has_value());
}

TEST(Recording, ReadsTwoVideos) {
  const TemporaryFolder folder;
  write_video(folder / "left.avi", eye(kLeftLevel, 5));
  write_video(folder / "right.avi", eye(kRightLevel, 5));
  RecordingOptions options;
  options.left = folder / "left.avi";
  options.right = folder / "right.avi";
  expect_all(options, 5);
  EXPECT_EQ(Recording(options).fps(), 25);
  options.fps = 50;
  EXPECT_EQ(Recording(options).fps(), 50);
  options.swap = true;
  expect_all(options, 5, kRightLevel, kLeftLevel);
}

TEST(Recording, SplitsSideBySideAndTopBottom) {
  const TemporaryFolder folder;
  for (const StereoLayout layout : {StereoLayout::side_by_side, StereoLayout::top_bottom}) {
    RecordingOptions options;
    options.stereo = folder / "both.avi";
    options.layout = layout;
    write_video(options.stereo, both_eyes(4, layout));
    expect_all(options, 4);
    options.swap = true;
    expect_all(options, 4, kRightLevel, kLeftLevel);
  }
}

TEST(Recording, ReadsNumberedImagesFromAnyFirstNumber) {
  const TemporaryFolder folder;
  for (int i = 0; i < 3; ++i) {
    cv::imwrite((folder / fmt::format("left_{:04d}.png", 98 + i)).string(), picture({64, 48}, kLeftLevel, i));
    cv::imwrite((folder / fmt::format("right_{:04d}.png", 98 + i)).string(), picture({64, 48}, kRightLevel, i));
  }
  RecordingOptions options;
  options.left = folder / "left_%04d.png";
  options.right = folder / "right_%04d.png";
  expect_all(options, 3);
  std::filesystem::remove(folder / "right_0099.png");
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }),
              AllOf(HasSubstr("recording.right"), HasSubstr("99"), HasSubstr("missing")));
}

TEST(Recording, ReadsAPairOfSingleImages) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.left = folder / "f7_L_0100.png";
  options.right = folder / "f7_R_0100.png";
  cv::imwrite(options.left.string(), picture({64, 48}, kLeftLevel, 0));
  cv::imwrite(options.right.string(), picture({64, 48}, kRightLevel, 0));
  expect_all(options, 1);
}

TEST(Recording, SaysWhatIsMissingEmptyOrNoVideo) {
  const TemporaryFolder folder;
  write_video(folder / "left.avi", eye(kLeftLevel, 3));
  RecordingOptions options;
  options.left = folder / "left.avi";
  const auto sentence = [&](const std::string& name) {
    options.right = folder / name;
    return sentence_of([&] { Recording recording(options); });
  };
  EXPECT_THAT(sentence("none.avi"), AllOf(HasSubstr("recording.right"), HasSubstr("none.avi"), HasSubstr("exist")));
  folder.write("empty.avi", "");
  EXPECT_THAT(sentence("empty.avi"), AllOf(HasSubstr("empty.avi"), HasSubstr("is empty")));
  folder.write("text.avi", "this is no video");
  EXPECT_THAT(sentence("text.avi"), AllOf(HasSubstr("text.avi"), HasSubstr("cannot be opened")));
  folder.write("text.png", "this is no image");
  EXPECT_THAT(sentence("text.png"), AllOf(HasSubstr("text.png"), HasSubstr("not an image")));
  EXPECT_THAT(sentence("right_%04d.png"), HasSubstr("no image is named like"));
}

TEST(Recording, SaysHowLeftAndRightDiffer) {
  const TemporaryFolder folder;
  write_video(folder / "left.avi", eye(kLeftLevel, 5));
  RecordingOptions options;
  options.left = folder / "left.avi";
  options.right = folder / "right.avi";
  write_video(options.right, eye(kRightLevel, 4));
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), AllOf(HasSubstr("5 frames"), HasSubstr("has 4")));
  write_video(options.right, eye(kRightLevel, 5, {80, 48}));
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), AllOf(HasSubstr("64x48"), HasSubstr("80x48")));
}

TEST(Recording, RefusesAnOddWidthSideBySide) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.stereo = folder / "odd.png";
  cv::imwrite(options.stereo.string(), cv::Mat(48, 129, CV_8UC3, cv::Scalar::all(90)));
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), AllOf(HasSubstr("129x48"), HasSubstr("even width")));
  options.layout = StereoLayout::top_bottom;
  EXPECT_EQ(Recording(options).size(), cv::Size(129, 24));
}

TEST(Recording, RefusesHalfAPair) {
  RecordingOptions options;
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), HasSubstr("expected left and right, or stereo"));
  options.left = "left.mp4";
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), HasSubstr("recording.right is missing"));
  options.right = "right.mp4";
  options.stereo = "both.mp4";
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), HasSubstr("either"));
}

TEST(Recording, EndsUnfinishedWhenTheVideoIsTruncated) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.stereo = folder / "both.avi";
  write_video(options.stereo, both_eyes(60, StereoLayout::side_by_side));
  std::filesystem::resize_file(options.stereo, std::filesystem::file_size(options.stereo) * 3 / 4);
  Recording recording(options);
  ASSERT_EQ(recording.frame_count(), 60);
  int frames = 0;
  std::string sentence;
  try {
    while (recording.next()) ++frames;
  } catch (const Unfinished& error) {
    sentence = error.what();
  }
  EXPECT_GT(frames, 0);
  EXPECT_LT(frames, 60);
  EXPECT_THAT(sentence,
              AllOf(HasSubstr("both.avi"), HasSubstr(fmt::format("after {} frames", frames)), HasSubstr("60")));
}

}  // namespace
}  // namespace palpate
