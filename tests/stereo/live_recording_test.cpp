#include <opencv2/imgproc.hpp>

#include "palpate/stereo/recording.h"
#include "tests/stereo/files.h"
#include "tests/support/live_cameras.h"

namespace palpate {
namespace {

using test::painted_number;
using test::receiver;
using test::Senders;
using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kPictures = 500, kLeftLevel = 70, kRightLevel = 170;

cv::Mat plain(int level) {
  return {48, 128, CV_8UC3, cv::Scalar::all(level)};
}

int level_of(const cv::Mat& image) {
  return image.at<cv::Vec3b>(40, 60)[1];
}

/// Two cameras that send over loopback, each picture with its number.
class LiveRecording : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_gstreamer()) GTEST_SKIP() << "gst-launch-1.0 or its plugins are missing";
    test::write_numbered(folder_ / "", "left", std::vector<cv::Mat>(kPictures, plain(kLeftLevel)));
    test::write_numbered(folder_ / "", "right", std::vector<cv::Mat>(kPictures, plain(kRightLevel)));
  }

  RecordingOptions both() const {
    RecordingOptions options;
    options.left = receiver(left_.port);
    options.right = receiver(right_.port);
    return options;
  }

  std::unique_ptr<Senders> send(const std::vector<test::Sender>& cameras) const {
    return std::make_unique<Senders>(folder_ / "", cameras);
  }

  /// The next frame for which this holds.
  template <class Condition>
  static StereoFrame next_where(Recording& recording, const Condition& holds) {
    while (true) {
      const std::optional<StereoFrame> frame = recording.next();
      if (!frame) throw std::runtime_error("the recording ended");
      if (holds(*frame)) return *frame;
    }
  }
  static bool is_pair(const StereoFrame& frame) { return !frame.left.empty() && !frame.right.empty(); }
  static bool is_silent(const StereoFrame& frame) { return frame.left.empty() && frame.right.empty(); }

  static void expect_pairs(Recording& recording, int count) {
    for (int i = 0; i < count; ++i) {
      const StereoFrame frame = next_where(recording, is_pair);
      EXPECT_EQ(painted_number(frame.left), painted_number(frame.right));
      EXPECT_NEAR(level_of(frame.left), kLeftLevel, 6);
      EXPECT_NEAR(level_of(frame.right), kRightLevel, 6);
    }
  }

  TemporaryFolder folder_;
  test::Sender left_{"left", test::free_port(), 0}, right_{"right", test::free_port(), 0};
};

TEST_F(LiveRecording, TwoCamerasOverTcpArePairedByStampAndNumberedByTime) {
  const auto senders = send({left_, right_});
  Recording recording(both());
  EXPECT_TRUE(recording.is_live());
  EXPECT_EQ(recording.size(), cv::Size(128, 48));
  EXPECT_EQ(recording.frame_count(), -1);
  EXPECT_EQ(recording.fps(), 25);
  EXPECT_EQ(describe_timing(recording.timing()), "live, 25.00 frames/s");
  const StereoFrame first = next_where(recording, is_pair);
  for (int i = 0; i < 20; ++i) {
    const StereoFrame frame = next_where(recording, is_pair);
    const int number = painted_number(frame.left);
    EXPECT_EQ(number, painted_number(frame.right));
    // Its time is that of the picture, whenever it came.
    EXPECT_NEAR(frame.time_s - first.time_s, 0.04 * (number - painted_number(first.left)), 1e-3);
  }
}

TEST_F(LiveRecording, ACameraThatIsLateIsWaitedFor) {
  right_.late_ms = 130;
  const auto senders = send({left_, right_});
  Recording recording(both());
  expect_pairs(recording, 20);
}

TEST_F(LiveRecording, TheNewestPairWinsAndTheOthersAreCounted) {
  const auto senders = send({left_, right_});
  Recording recording(both());
  const StereoFrame before = next_where(recording, is_pair);
  const int dropped_at_first = recording.dropped();
  int heard = 0;
  std::mutex mutex;
  std::condition_variable came;
  recording.listen([&](const StereoFrame&) {
    const std::lock_guard lock(mutex);
    ++heard;
    came.notify_all();
  });
  {
    std::unique_lock lock(mutex);
    came.wait(lock, [&] { return heard >= 10; });
  }
  recording.listen({});
  const StereoFrame after = next_where(recording, is_pair);
  const int dropped = recording.dropped() - dropped_at_first;
  EXPECT_GE(dropped, 9);
  // Each picture was given, or is counted.
  EXPECT_GE(1 + dropped, painted_number(after.left) - painted_number(before.left));
  EXPECT_EQ(after.index, before.index + 1);
}

TEST_F(LiveRecording, ASourceThatStopsSaysSoAndComesBack) {
  auto senders = send({left_, right_});
  Recording recording(both());
  expect_pairs(recording, 5);
  senders.reset();
  const StereoFrame silent = next_where(recording, is_silent);
  senders = send({left_, right_});
  const StereoFrame back = next_where(recording, is_pair);
  EXPECT_GT(back.time_s, silent.time_s);
  EXPECT_GT(back.index, silent.index);
  expect_pairs(recording, 10);
}

TEST_F(LiveRecording, OneCameraThatStandsStillIsMissingUntilItGoesOn) {
  const auto left = send({left_}), right = send({right_});
  Recording recording(both());
  expect_pairs(recording, 5);
  right->hold();
  next_where(recording, [](const StereoFrame& frame) { return !frame.left.empty() && frame.right.empty(); });
  right->go_on();
  expect_pairs(recording, 10);
}

TEST_F(LiveRecording, BothCamerasInOnePictureAreCutApartAndCanBeExchanged) {
  cv::Mat side_by_side;
  cv::hconcat(plain(kLeftLevel), plain(kRightLevel), side_by_side);
  test::write_numbered(folder_ / "", "both", std::vector<cv::Mat>(kPictures, side_by_side));
  const auto sender = send({{"both", left_.port, 0}});
  RecordingOptions options;
  options.stereo = receiver(left_.port);
  options.swap = true;
  Recording recording(options);
  EXPECT_EQ(recording.size(), cv::Size(128, 48));
  const StereoFrame frame = next_where(recording, is_pair);
  EXPECT_NEAR(level_of(frame.left), kRightLevel, 6);
  EXPECT_NEAR(level_of(frame.right), kLeftLevel, 6);
}

TEST_F(LiveRecording, APipelineOfKnownLengthEnds) {
  RecordingOptions options;
  options.stereo = "videotestsrc num-buffers=30 ! video/x-raw,width=64,height=32,framerate=25/1 ! appsink drop=true";
  Recording recording(options);
  int frames = 0;
  while (recording.next()) ++frames;
  EXPECT_GE(frames, 1);
}

TEST(LiveSources, WhatCannotBeHadIsASentence) {
  const auto complaint = [](const std::string& left, const std::string& right) {
    RecordingOptions options;
    options.left = left;
    options.right = right;
    return sentence_of([&] { Recording recording(options); });
  };
  EXPECT_THAT(complaint("nosuchelement ! x", "videotestsrc ! identity"),
              AllOf(HasSubstr("recording.left: nosuchelement ! x is no GStreamer pipeline that can be made"),
                    HasSubstr("no element \"nosuchelement\"")));
  EXPECT_THAT(complaint("videotestsrc ! identity", "right.mp4"),
              HasSubstr("recording.left is live and recording.right is not"));
  EXPECT_THAT(complaint(receiver(test::free_port()), "videotestsrc ! identity"),
              AllOf(HasSubstr("recording.left: tcpclientsrc"), HasSubstr("Connection refused")));
  EXPECT_THAT(complaint("97", "98"), HasSubstr(": Cannot identify device '/dev/video9"));
}

}  // namespace
}  // namespace palpate
