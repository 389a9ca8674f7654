#include "palpate/stream/ros2_publisher.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "palpate/core/errors.h"
#include "tests/stream/other_program.h"
#include "tests/stream/samples.h"

namespace palpate {
namespace {

/// Apart from other runs on this machine.
Ros2Options own_domain() {
  Ros2Options options;
  options.domain = 60 + static_cast<int>(getpid() % 100);
  return options;
}

TEST(Ros2Publisher, IsUnderstoodByFastDds) {
  const Ros2Options options = own_domain();
  auto subscriber = test::OtherProgram::start("ros2_subscriber", {std::to_string(options.domain)});
  if (!subscriber) GTEST_SKIP() << "Fast DDS is not installed (libfastrtps-dev, libfastcdr-dev)";
  Ros2Publisher publisher(options);
  for (const char* name : {"wrench matched", "pose matched", "image matched"})
    ASSERT_TRUE(subscriber->soon_writes(name)) << subscriber->output();

  // A reader may know of a writer before the writer knows of it: what is sent in between is lost.
  const auto arrives = [&](const std::string& line) {
    return test::soon([&] {
      auto frame = test::frame_of(test::touching());
      frame->wall_ns = 1'700'000'000'123'456'789;
      publisher.publish(frame);
      return subscriber->output().find(line) != std::string::npos;
    });
  };
  EXPECT_TRUE(arrives("wrench 1700000000.123456789 left_camera 0.1 -0.2 0.3 0 0 0")) << subscriber->output();
  EXPECT_TRUE(arrives("pose 1700000000.123456789 left_camera 0.01 0.02 0.09 0 0 0 1")) << subscriber->output();
  EXPECT_TRUE(arrives("image 1700000000.123456789 left_camera jpeg ffd8 1")) << subscriber->output();
}

TEST(Ros2Publisher, ASecondInstrumentHasTopicsOfItsOwn) {
  const Ros2Options options = own_domain();
  auto subscriber = test::OtherProgram::start("ros2_subscriber", {std::to_string(options.domain)});
  if (!subscriber) GTEST_SKIP() << "Fast DDS is not installed (libfastrtps-dev, libfastcdr-dev)";
  Ros2Publisher publisher(options);
  ASSERT_TRUE(subscriber->soon_writes("wrench_2 matched")) << subscriber->output();
  const auto frame = test::frame_of(test::both_touching());
  EXPECT_TRUE(test::soon([&] {
    publisher.publish(frame);
    return subscriber->output().find("left_camera 0 0 -0.5 0 0 0") != std::string::npos;
  })) << subscriber->output();
}

TEST(Ros2Publisher, SaysOnceThatTheForceIsLostAndThenNothing) {
  const Ros2Options options = own_domain();
  auto subscriber = test::OtherProgram::start("ros2_subscriber", {std::to_string(options.domain)});
  if (!subscriber) GTEST_SKIP() << "Fast DDS is not installed (libfastrtps-dev, libfastcdr-dev)";
  Ros2Publisher publisher(options);
  ASSERT_TRUE(subscriber->soon_writes("wrench matched") && subscriber->soon_writes("pose matched"));
  const auto publish = [&](const ForceEstimate& estimate, int64_t wall_ns) {
    auto frame = test::frame_of(estimate);
    frame->overlay = cv::Mat();
    frame->wall_ns = wall_ns;
    publisher.publish(frame);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  };
  ASSERT_TRUE(test::soon([&] {
    publish(test::touching(), 1'000'000'000);
    return subscriber->output().find("wrench 1.") != std::string::npos;
  }));
  for (int i = 0; i < 5; ++i) publish(test::lost(), 2'000'000'000);
  publish(test::touching(), 3'000'000'000);
  ASSERT_TRUE(subscriber->soon_writes("wrench 3.000000000")) << subscriber->output();
  const std::string all = subscriber->output();
  const size_t lost = all.find("wrench 0.000000000 left_camera 0 0 0 0 0 0");
  ASSERT_NE(lost, std::string::npos) << all;
  EXPECT_EQ(all.find("wrench 0.", lost + 1), std::string::npos) << all;
  EXPECT_EQ(all.find("wrench 2."), std::string::npos);
}

TEST(Ros2Publisher, AnInterfaceThatIsNotThereIsOneSentence) {
  Ros2Options options = own_domain();
  options.interface = "nowhere0";
  try {
    const Ros2Publisher publisher(options);
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("nowhere0"), std::string::npos);
  }
}

}  // namespace
}  // namespace palpate
