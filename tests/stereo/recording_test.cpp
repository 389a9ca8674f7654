#include "palpate/stereo/recording.h"

#include <fmt/core.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/stereo/small_recordings.h"

namespace palpate {
namespace {

using test::camera;
using test::kLeftLevel;
using test::kRightLevel;
using test::pairs_and_times;
using test::picture;
using test::sentence_of;
using test::TemporaryFolder;
using test::write_video;
using testing::AllOf;
using testing::HasSubstr;
using namespace std::string_literals;

std::vector<cv::Mat> both_cameras(int frames, StereoLayout layout) {
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

void expect_cameras(const StereoFrame& frame, int left, int right, int index) {
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
    expect_cameras(*frame, left, right, i);
    EXPECT_NEAR(frame->time_s, i / recording.fps(), 1e-9);
  }
  EXPECT_FALSE(recording.next().has_value());
}

TEST(Recording, ReadsTwoVideos) {
  const TemporaryFolder folder;
  write_video(folder / "left.avi", camera(kLeftLevel, 5));
  write_video(folder / "right.avi", camera(kRightLevel, 5));
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
    write_video(options.stereo, both_cameras(4, layout));
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
}

TEST(Recording, TakesNumbersOfImagesAsTheirTime) {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name) {
    std::filesystem::create_directories((folder / name).parent_path());
    cv::imwrite((folder / name).string(), picture({64, 48}, kLeftLevel, 0));
  };
  for (const int number : {1, 2, 4, 5}) write(fmt::format("image01/{:010d}.png", number));
  for (const int number : {1, 2, 3, 5}) write(fmt::format("image02/{:010d}.png", number));
  RecordingOptions options;
  options.left = folder / "image01/%010d.png";
  options.right = folder / "image02/%010d.png";
  EXPECT_EQ(pairs_and_times(options), std::pair("1101"s, "0,1,3,4"s));
  EXPECT_EQ(Recording(options).timing().gaps, 1);
  EXPECT_EQ(Recording(options).timing().right_without_left, 1);

  for (int i = 0; i < 3; ++i)
    for (const char* side : {"left", "right"}) write(fmt::format("{:04d}/{}.png", i, side));
  options.left = folder / "%04d/left.png";
  options.right = folder / "%04d/right.png";
  EXPECT_EQ(pairs_and_times(options), std::pair("111"s, "0,1,2"s));

  // Nanoseconds since 1970, the right camera 3 ms behind.
  for (const long long t : {0LL, 40000000LL, 120000000LL}) {
    write(fmt::format("cam0/{}.png", 1403636579763555584LL + t));
    write(fmt::format("cam1/{}.png", 1403636579766555584LL + t));
  }
  options.left = folder / "cam0/%d.png";
  options.right = folder / "cam1/%d.png";
  EXPECT_EQ(pairs_and_times(options), std::pair("111"s, "0,1,3"s));
  EXPECT_NEAR(Recording(options).timing().offset_ms, 3, 1e-3);
}

TEST(Recording, TakesTheTimesOfImagesFromAFileBesideThem) {
  const TemporaryFolder folder;
  for (const char* camera : {"image_0", "image_1"}) {
    std::filesystem::create_directories(folder / camera);
    for (int i = 0; i < 4; ++i)
      cv::imwrite((folder / camera / fmt::format("{:06d}.png", i)).string(), picture({64, 48}, kLeftLevel, i));
  }
  RecordingOptions options;
  options.left = folder / "image_0" / "%06d.png";
  options.right = folder / "image_1" / "%06d.png";
  const auto expect_times = [&](const char* what) {
    EXPECT_EQ(pairs_and_times(options), std::pair("1111"s, "0,1,3,4.5"s)) << what;
    EXPECT_THAT(Recording(options).notes(), testing::Contains(HasSubstr("times of the images from"))) << what;
  };
  folder.write("times.txt", "0.000000e+00\n4.000000e-02\n1.200000e-01\n1.800000e-01\n");
  expect_times("KITTI");
  folder.write("times.txt", "1403636579000000000\n1403636579040000000\n1403636579120000000\n1403636579180000000\n");
  expect_times("nanoseconds");
  folder.write("times.txt",
               "2011-09-26 13:02:25.960\n2011-09-26 13:02:26.000\n2011-09-26 13:02:26.080\n2011-09-26 13:02:26.140\n");
  expect_times("dates");
  std::filesystem::remove(folder / "times.txt");
  for (const char* camera : {"image_0", "image_1"})
    folder.write(std::string(camera) + "/data.csv",
                 "#timestamp [ns],filename\n1000000000,000000.png\n1040000000,000001.png\n1080000000,left out.png\n"
                 "1120000000,000002.png\n1180000000,000003.png\n");
  expect_times("EuRoC");
  options.fps = 50;
  EXPECT_EQ(pairs_and_times(options).second, "0,0.5,1,1.5");
  options.fps = 0;
  for (const char* camera : {"image_0", "image_1"}) std::filesystem::remove(folder / camera / "data.csv");
  folder.write("times.txt", "0\n0.04\n");
  EXPECT_EQ(pairs_and_times(options).second, "0,1,2,3");
  EXPECT_THAT(Recording(options).notes(),
              testing::Contains(HasSubstr("holds 2 times, expected one for each of the 4")));
  folder.write("times.txt", "0\n1\n2\n3\n");
  EXPECT_EQ(pairs_and_times(options).second, "0,1,2,3");
}

TEST(Recording, ShowsTwelveBitsInSixteenAndGreyImages) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.left = folder / "l.png";
  options.right = folder / "r.png";
  cv::imwrite(options.left.string(), cv::Mat(48, 64, CV_16UC1, cv::Scalar::all(4095)));
  cv::imwrite(options.right.string(), cv::Mat(48, 64, CV_8UC1, cv::Scalar::all(100)));
  const auto frame = Recording(options).next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->left.at<cv::Vec3b>(5, 5), cv::Vec3b::all(255));
  EXPECT_EQ(frame->right.at<cv::Vec3b>(5, 5), cv::Vec3b::all(100));
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
  write_video(folder / "left.avi", camera(kLeftLevel, 3));
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

TEST(Recording, RefusesImagesWhoseNumbersDoNotTellTheMoment) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.left = folder / "left_%d.png";
  options.right = folder / "right_%d.png";
  for (int i = 0; i < 2; ++i) {
    cv::imwrite((folder / fmt::format("left_{}.png", i)).string(), picture({64, 48}, kLeftLevel, i));
    cv::imwrite((folder / fmt::format("right_{}.png", i + 1)).string(), picture({64, 48}, kRightLevel, i));
  }
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }), HasSubstr("begin with different numbers (0 and 1)"));
}

TEST(Recording, SaysHowLeftAndRightDiffer) {
  const TemporaryFolder folder;
  write_video(folder / "left.avi", camera(kLeftLevel, 5));
  RecordingOptions options;
  options.left = folder / "left.avi";
  options.right = folder / "right.avi";
  write_video(options.right, camera(kRightLevel, 4));
  EXPECT_EQ(pairs_and_times(options).first, "11110");
  write_video(options.right, camera(kRightLevel, 5, {80, 48}));
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
  write_video(options.stereo, both_cameras(60, StereoLayout::side_by_side));
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

TEST(Recording, EndsUnfinishedWhenTheVideoShrinksWhileItIsRead) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.stereo = folder / "both.avi";
  write_video(options.stereo, both_cameras(120, StereoLayout::side_by_side));
  Recording recording(options);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(recording.next());
  std::filesystem::resize_file(options.stereo, std::filesystem::file_size(options.stereo) / 2);
  EXPECT_THROW(while (recording.next()){}, Unfinished);
}

}  // namespace
}  // namespace palpate
