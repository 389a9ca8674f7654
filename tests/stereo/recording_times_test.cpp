#include "tests/stereo/small_recordings.h"

namespace palpate {
namespace {

using test::pairs_and_times;
using namespace std::string_literals;

class MadeByFfmpeg : public test::MadeByFfmpeg {};

TEST_F(MadeByFfmpeg, FramesHaveTheTimeAtWhichTheyAreShown) {
  for (const char* side : {"left", "right"}) {
    const std::string from = fmt::format("{}.avi", side);
    // Frames 3 and 4 are dropped: the rate varies.
    make(from, "-vf \"select='not(between(n,3,4))'\" -vsync vfr -c:v mpeg4", fmt::format("{}_vfr.mp4", side));
    make(from, "-c:v mpeg4 -g 20", fmt::format("{}_whole.mp4", side));
    // The key frame of the cut lies before it; an edit list hides what comes before.
    make(fmt::format("{}_whole.mp4", side), "-c copy", fmt::format("{}_cut.mp4", side), "-ss 0.2");
    make(from, "-c:v mpeg2video -q:v 2", fmt::format("{}.ts", side));  // starts at 1.4 s
    make(from, "-c:v mpeg4", fmt::format("{}.mkv", side));
  }
  EXPECT_EQ(pairs_and_times(options("left_vfr.mp4", "right_vfr.mp4")), std::pair("11111111"s, "0,1,2,5,6,7,8,9"s));
  EXPECT_EQ(pairs_and_times(options("left_cut.mp4", "right_cut.mp4")), std::pair("11111"s, "0,1,2,3,4"s));
  EXPECT_EQ(Recording(options("left_cut.mp4", "right_cut.mp4")).frame_count(), 5);
  EXPECT_EQ(pairs_and_times(options("left.ts", "right.ts")), std::pair("1111111111"s, "0,1,2,3,4,5,6,7,8,9"s));
  EXPECT_EQ(pairs_and_times(options("left.mkv", "right.mkv")), std::pair("1111111111"s, "0,1,2,3,4,5,6,7,8,9"s));
  EXPECT_EQ(pairs_and_times(options("left.ts", "right.mkv")).first, "1111111111");
}

TEST_F(MadeByFfmpeg, LeftAndRightArePairedByTheirTime) {
  make("left.avi", "-c:v mpeg4", "left.mp4");
  make("right.avi", "-vf \"select='not(eq(n,4))'\" -vsync vfr -c:v mpeg4", "dropped.mp4");
  EXPECT_EQ(pairs_and_times(options("left.mp4", "dropped.mp4")).first, "1111011111");
  make("right.avi", "-vf fps=50 -c:v mpeg4", "twice.mp4");
  EXPECT_EQ(pairs_and_times(options("left.mp4", "twice.mp4")).first, "1111111111");
  EXPECT_EQ(Recording(options("left.mp4", "twice.mp4")).timing().right_without_left, 10);
  make("right.avi", "-vf \"setpts=PTS+3/25/TB\" -vsync passthrough -c:v mpeg4", "late.mkv");
  make("left.avi", "-c:v mpeg4", "left.mkv");
  EXPECT_EQ(pairs_and_times(options("left.mkv", "late.mkv")).first, "0001111111");
  Recording recording(options("left.mkv", "late.mkv"));
  while (const auto frame = recording.next()) {
    if (frame->right.empty()) continue;
    EXPECT_GT(frame->right.at<cv::Vec3b>(4 * (frame->index - 3) + 2, 32)[0], 200) << frame->index;
  }
}

}  // namespace
}  // namespace palpate
