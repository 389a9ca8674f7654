#include <opencv2/imgcodecs.hpp>

#include "tests/stereo/small_recordings.h"

namespace palpate {
namespace {

using test::camera;
using test::kLeftLevel;
using test::pairs_and_times;
using test::picture;
using test::sentence_of;
using test::TemporaryFolder;
using test::write_video;
using testing::HasSubstr;

TEST(ImagePattern, OpensNamesWithAPercentSign) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.left = folder / "left%20dull.png";
  options.right = folder / "right%20dull.png";
  for (const auto& path : {options.left, options.right}) cv::imwrite(path.string(), picture({64, 48}, kLeftLevel, 0));
  EXPECT_EQ(pairs_and_times(options).first, "1");
  options.left = folder / "20%_left.avi";
  options.right = folder / "20%_right.avi";
  for (const auto& path : {options.left, options.right}) write_video(path, camera(kLeftLevel, 2));
  EXPECT_EQ(pairs_and_times(options).first, "11");
}

TEST(ImagePattern, WhatLooksLikeANumberInANameMayBeMeantAsItStands) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "100%done");
  for (int i = 0; i < 3; ++i)
    for (const char* side : {"left", "right"})
      cv::imwrite((folder / "100%done" / fmt::format("20%d_{}_{:02d}.png", side, i)).string(),
                  picture({64, 48}, kLeftLevel, i));
  RecordingOptions options;
  for (const char* percent : {"%", "%%"}) {
    options.left = folder / fmt::format("100{0}done", percent) / fmt::format("20{}d_left_%02d.png", percent);
    options.right = folder / fmt::format("100{0}done", percent) / fmt::format("20{}d_right_%02d.png", percent);
    EXPECT_EQ(pairs_and_times(options).first, "111") << options.left;
  }
  options.left = folder / "100%done" / "%02d.png";
  EXPECT_THAT(sentence_of([&] { Recording recording(options); }),
              HasSubstr("a percent sign that begins no number is written %%"));
}

}  // namespace
}  // namespace palpate
