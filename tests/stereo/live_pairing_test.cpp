#include "palpate/stereo/live_pairing.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

constexpr int64_t kMs = 1'000'000, kStep = 40 * kMs;

/// A picture whose only pixel tells its number.
StampedPicture picture(int number, int64_t stamp_ns, int64_t came_ns) {
  return {cv::Mat(1, 1, CV_8U, cv::Scalar(number)), stamp_ns, came_ns, {}};
}

int number_of(const cv::Mat& image) {
  return image.empty() ? -1 : image.at<uchar>(0);
}

/// "0+0 1+1 2-" of pairs.
std::string text_of(const std::vector<LivePair>& pairs) {
  std::string text;
  for (const LivePair& pair : pairs) {
    text += text.empty() ? "" : " ";
    text += std::to_string(number_of(pair.left));
    text += pair.right.empty() ? "-" : "+" + std::to_string(number_of(pair.right));
  }
  return text;
}

TEST(LivePairing, ALateCameraIsWaitedForAndMeetsItsOwnMoment) {
  LivePairing pairing(true);
  constexpr int64_t kStart = 5'000 * kMs, kLate = 130 * kMs;
  std::string all;
  for (int i = 0; i < 12; ++i) {
    const int64_t now = kStart + i * kStep;
    pairing.add_left(picture(i, i * kStep, now));
    const int late = i - static_cast<int>(kLate / kStep);
    if (late >= 0) pairing.add_right(picture(late, late * kStep, now));
    all += text_of(pairing.settled(now)) + ";";
  }
  EXPECT_EQ(all, ";;;0+0;1+1;2+2;3+3;4+4;5+5;6+6;7+7;8+8;");
}

TEST(LivePairing, AMissingRightPictureIsNotWaitedForOnceALaterOneIsThere) {
  LivePairing pairing(true);
  for (int i = 0; i < 4; ++i) {
    pairing.add_left(picture(i, i * kStep, i * kStep));
    if (i != 1) pairing.add_right(picture(i, i * kStep + 3 * kMs, i * kStep));
  }
  EXPECT_EQ(text_of(pairing.settled(4 * kStep)), "0+0 1- 2+2 3+3");
}

TEST(LivePairing, ASilentRightCameraIsWaitedForOnceAndNotForEachPicture) {
  LivePairing pairing(true);
  pairing.add_left(picture(0, 0, 0));
  pairing.add_right(picture(0, 0, 0));
  EXPECT_EQ(text_of(pairing.settled(0)), "0+0");
  std::string all;
  for (int i = 1; i < 12; ++i) {
    pairing.add_left(picture(i, i * kStep, i * kStep));
    all += text_of(pairing.settled(i * kStep)) + ";";
  }
  EXPECT_EQ(all, ";;;;;;;1- 2- 3- 4- 5- 6- 7- 8-;9-;10-;11-;");
}

TEST(LivePairing, StampsThatBeginAnewGoOnByTheTimeAtWhichTheyCome) {
  LivePairing pairing(true);
  std::vector<LivePair> pairs;
  const auto show = [&](int number, int64_t stamp, int64_t now) {
    pairing.add_left(picture(number, stamp, now));
    pairing.add_right(picture(number, stamp, now + 9 * kMs));
    for (LivePair& pair : pairing.settled(now + 9 * kMs)) pairs.push_back(pair);
  };
  for (int i = 0; i < 3; ++i) show(i, 7'000 * kMs + i * kStep, i * kStep);
  for (int i = 3; i < 6; ++i) show(i, (i - 3) * kStep, 4'000 * kMs + i * kStep);
  EXPECT_EQ(text_of(pairs), "0+0 1+1 2+2 3+3 4+4 5+5");
  for (size_t i = 1; i < pairs.size(); ++i) EXPECT_GT(pairs[i].stamp_ns, pairs[i - 1].stamp_ns);
  EXPECT_EQ(pairs[3].stamp_ns - pairs[2].stamp_ns, 4'000 * kMs + kStep);
}

TEST(LivePairing, StampsOfOurOwnClockTellWhenAPictureWasTaken) {
  LivePairing pairing(false);
  StampedPicture late = picture(0, 100 * kMs, 9'130 * kMs);
  late.clock_ns = 9'000 * kMs;
  pairing.add_left(late);
  EXPECT_EQ(pairing.settled(9'130 * kMs).at(0).taken_ns, 9'100 * kMs);
}

TEST(LivePairing, AFirstPictureThatComesLateDoesNotSetTheClockForTheOthers) {
  LivePairing pairing(true);
  std::vector<LivePair> pairs;
  constexpr int64_t kStart = 3'000 * kMs, kHeldUp = 30 * kMs;
  for (int i = 0; i < 6; ++i) {
    const int64_t came = kStart + i * kStep + (i == 0 ? kHeldUp : 0);
    pairing.add_left(picture(i, i * kStep, came));
    pairing.add_right(picture(i, i * kStep, came + 1 * kMs));
    for (LivePair& pair : pairing.settled(came + 1 * kMs)) pairs.push_back(pair);
  }
  EXPECT_EQ(text_of(pairs), "0+0 1+1 2+2 3+3 4+4 5+5");
  for (size_t i = 1; i < 6; ++i) EXPECT_EQ(pairs[i].stamp_ns - pairs[i - 1].stamp_ns, kStep);
  for (int i = 1; i < 6; ++i) EXPECT_EQ(pairs[static_cast<size_t>(i)].taken_ns, kStart + i * kStep);
}

TEST(LivePairing, OneCameraThatShowsBothNeedsNoPartner) {
  LivePairing pairing(false);
  for (int i = 0; i < 3; ++i) pairing.add_left(picture(i, i * kStep, i * kStep));
  EXPECT_EQ(text_of(pairing.settled(3 * kStep)), "0- 1- 2-");
}

}  // namespace
}  // namespace palpate
