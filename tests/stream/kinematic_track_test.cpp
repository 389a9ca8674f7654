#include "palpate/stream/kinematic_track.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "palpate/core/errors.h"
#include "palpate/stream/igtl_server.h"
#include "palpate/stream/track_source.h"
#include "tests/stream/other_program.h"
#include "tests/stream/samples.h"

namespace palpate {
namespace {

TEST(TrackSource, IsAServerAndADeviceOrADeviceAlone) {
  const TrackSource server = parse_track_source("openigtlink:localhost:18944/PSM1");
  ASSERT_TRUE(server.server);
  EXPECT_EQ(server.server->host, "localhost");
  EXPECT_EQ(server.server->port, 18944);
  EXPECT_EQ(server.device, "PSM1");
  const TrackSource client = parse_track_source("openigtlink:/Tracker");
  EXPECT_FALSE(client.server);
  EXPECT_EQ(client.device, "Tracker");
  for (const char* wrong : {"openigtlink:localhost:18944", "openigtlink:localhost/PSM1", "openigtlink:", "tip.csv"})
    EXPECT_THROW(parse_track_source(wrong), BadInput) << wrong;
}

IgtlReceived at(const Vec3& position_mm, const std::string& device = "PSM1") {
  IgtlReceived message;
  message.type = "TRANSFORM";
  message.device = device;
  message.translation_mm = position_mm;
  return message;
}

TEST(KinematicTrack, GivesTheNewestTipInTheCameraFrameWhileItIsFresh) {
  CameraFromRobot camera_from_robot;
  camera_from_robot.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  camera_from_robot.translation_mm = {10, 20, 30};
  KinematicTrack track("openigtlink:/PSM1", camera_from_robot);
  EXPECT_FALSE(track.at_frame());
  track.take(at({1, 0, 0}));
  track.take(at({1, 2, 3}));
  track.take(at({7, 7, 7}, "another device"));
  const auto row = track.at_frame();
  ASSERT_TRUE(row);
  EXPECT_LT((row->tip_mm - Vec3(8, 21, 33)).norm(), 1e-12);
  EXPECT_TRUE(track.last_at_frame().known);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  EXPECT_FALSE(track.at_frame());
  EXPECT_FALSE(track.last_at_frame().known);
}

TEST(KinematicTrack, ReadsFromTrackerServer) {
  const int port = test::on_free_port().port;
  KinematicTrack track("openigtlink:127.0.0.1:" + std::to_string(port) + "/Tracker", {});
  track.start();  // before there is a server
  const auto program = test::OtherProgram::start("igtl_TrackerServer", {std::to_string(port), "100"});
  if (!program) GTEST_SKIP() << "the examples of OpenIGTLink are not installed (openigtlink-examples)";
  EXPECT_TRUE(test::soon([&] {
    const auto row = track.at_frame();
    return row && std::abs(row->tip_mm.x() - row->tip_mm.z()) < 1e-3 &&
           std::abs(row->tip_mm.head<2>().norm() - 50) < 1e-3;
  }));
}

TEST(KinematicTrack, ConnectsAgainToAServerThatWasGone) {
  const OpenIgtLinkOptions options = test::on_free_port();
  KinematicTrack track("openigtlink:127.0.0.1:" + std::to_string(options.port) + "/PalpateTip", {});
  track.start();
  for (int i = 0; i < 2; ++i) {
    {
      IgtlServer server(options, test::small_scene(), {}, {});
      EXPECT_TRUE(test::soon([&] {
        server.publish(test::frame_of(test::touching()));
        const auto row = track.at_frame();
        return row && (row->tip_mm - Vec3(-10, -20, 90)).norm() < 1e-6;
      }));
    }
    EXPECT_TRUE(test::soon([&] { return !track.at_frame(); }));
  }
}

}  // namespace
}  // namespace palpate
