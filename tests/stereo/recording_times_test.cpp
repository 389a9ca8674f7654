#include <opencv2/imgcodecs.hpp>

#include "palpate/stereo/packet_stamps.h"
#include "tests/stereo/small_recordings.h"

namespace palpate {
namespace {

using test::kLeftLevel;
using test::pairs_and_times;
using test::picture;
using testing::ElementsAre;
using testing::HasSubstr;
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

TEST_F(MadeByFfmpeg, JoinedStreamsGoOnWhereTheirTimesJumpBack) {
  for (const char* side : {"left", "right"}) {
    make(fmt::format("{}.avi", side), "-c:v mpeg2video -bf 2 -q:v 2", fmt::format("{}.ts", side));
    const std::string part = read(fmt::format("{}.ts", side));
    folder_.write(fmt::format("{}_joined.ts", side), part + part);
  }
  const RecordingOptions joined = options("left_joined.ts", "right_joined.ts");
  const auto [pairs, times] = pairs_and_times(joined);
  EXPECT_EQ(pairs, std::string(20, '1'));
  EXPECT_EQ(times, "0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19");
  const Recording recording(joined);
  EXPECT_EQ(recording.timing().gaps, 0);
  EXPECT_THAT(recording.notes(), testing::Contains(HasSubstr("left_joined.ts: its times jump back 1 times, first at "
                                                             "frame 10")));
}

TEST_F(MadeByFfmpeg, FramesOfDifferentContainersHaveOneClock) {
  make("left.avi", "-c:v mpeg4", "left.mp4");
  make("right.avi", "-vf \"setpts=PTS+3/25/TB\" -vsync passthrough -c:v mpeg4", "late.mkv");
  EXPECT_EQ(pairs_and_times(options("left.mp4", "late.mkv")).first, "0001111111");
  EXPECT_EQ(pairs_and_times(options("left.avi", "late.mkv")).first, "0001111111");
  for (const int first : {0, 1, 3}) {
    for (int i = 0; i < 10; ++i)
      cv::imwrite((folder_ / fmt::format("from_{}_{}.png", first, first + i)).string(), picture({64, 48}, 90, i));
    EXPECT_EQ(pairs_and_times(options("left.mp4", fmt::format("from_{}_%d.png", first))).first,
              first == 3 ? "0001111111" : "1111111111")
        << "images from " << first;
  }
}

TEST_F(MadeByFfmpeg, StreamsThatBeginAtAnyTimeAreCountedFromTheirFirstFrame) {
  make("left.avi", "-c:v mpeg4", "left.mp4");
  make("right.avi", "-vf \"setpts=PTS+3/25/TB\" -vsync passthrough -c:v mpeg2video -q:v 2", "late.ts");
  EXPECT_EQ(pairs_and_times(options("left.mp4", "late.ts")).first, "1111111111");
  EXPECT_THAT(Recording(options("left.mp4", "late.ts")).notes(),
              testing::Contains(HasSubstr("both are counted from their first frame")));
}

TEST(PacketStamps, PacketsWithoutAStampTakeTheirPlaceInTheOrderOfDecoding) {
  constexpr int64_t kFrame = 10;
  // I P B B P B B, three of them without a stamp of showing; one was dropped by the camera, between 130 and 150.
  const std::vector<PacketStamp> packets = {{110, 90},       {150, 100}, {120, 110},     {kNoStamp, 130},
                                            {kNoStamp, 140}, {160, 150}, {kNoStamp, 160}};
  EXPECT_THAT(shown_stamps(packets, kFrame), ElementsAre(110, 120, 130, 150, 160, 170, 180));
  EXPECT_THAT(shown_stamps({{kNoStamp, 5}, {kNoStamp, 15}, {kNoStamp, 25}}, kFrame), ElementsAre(5, 15, 25));
  EXPECT_THAT(shown_stamps({{}, {}, {}}, kFrame), ElementsAre(0, 10, 20));
  EXPECT_THAT(shown_stamps({{30, 20}, {10, 5}, {20, kNoStamp}}, kFrame), ElementsAre(10, 20, 30));
}

TEST(PacketStamps, APartThatJumpsBackBeginsAFrameAfterTheLastOne) {
  JoinedParts parts(10);
  std::vector<PacketStamp> stamps = {{110, 100}, {140, 110}, {120, 120}, {130, 130}, {60, 50}, {90, 60}, {70, 70}};
  std::string begins;
  std::vector<int64_t> shown;
  for (PacketStamp& stamp : stamps) {
    begins += parts.join(stamp) ? '1' : '0';
    shown.push_back(stamp.shown);
  }
  EXPECT_EQ(begins, "0000100");
  EXPECT_THAT(shown, ElementsAre(110, 140, 120, 130, 150, 180, 160));
}

TEST_F(MadeByFfmpeg, ProgramStreamsWithoutAllTheirStampsHaveNoGaps) {
  // H.264 of small frames: several begin in one packet of the stream, which carries a single stamp.
  for (const char* side : {"left", "right"})
    make(fmt::format("{}.avi", side), "-c:v libx264 -bf 2 -pix_fmt yuv420p -f vob", fmt::format("{}.mpg", side));
  EXPECT_EQ(pairs_and_times(options("left.mpg", "right.mpg")), std::pair("1111111111"s, "0,1,2,3,4,5,6,7,8,9"s));
}

}  // namespace
}  // namespace palpate
