#include "palpate/stream/force_loop.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <chrono>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/stream/address.h"
#include "tests/stream/samples.h"

namespace palpate {
namespace {

using namespace std::chrono_literals;

/// Listens for the loop's records.
class Listener {
 public:
  Listener() : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), size);
    getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&address), &size);
    options.udp = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    const timeval ten_seconds{10, 0};
    setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &ten_seconds, sizeof ten_seconds);
  }
  std::optional<ForceSample> next() {
    std::array<uint8_t, 100> bytes;
    const ssize_t size = recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (size < 0) return std::nullopt;
    return from_record({bytes.data(), static_cast<size_t>(size)});
  }
  ForceLoopOptions options;

 private:
  Descriptor socket_;
};

ContactSpring touching_now() {
  return contact_spring(test::touching(), 0.3, steady_ns());
}

Vec3 force_of(const ForceSample& sample) {
  return {sample.force_N[0], sample.force_N[1], sample.force_N[2]};
}

TEST(ForceRecord, KeepsWhatItWasGivenAndRefusesWhatIsDamaged) {
  ForceSample sample;
  sample.sequence = 77;
  sample.wall_ns = 1'700'000'000'123'456'789;
  sample.valid = sample.damped = true;
  sample.force_N = {1, -2, 3};
  sample.tip_mm = {4, 5, -6};
  sample.stiffness_N_per_mm = 0.5F;
  sample.frame = 9;
  sample.frame_age_us = 40000;
  ForceRecord record = to_record(sample);
  const auto back = from_record(record);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->sequence, 77U);
  EXPECT_EQ(back->wall_ns, sample.wall_ns);
  EXPECT_TRUE(back->valid && back->damped && !back->limited && !back->in_contact && !back->frames_late);
  EXPECT_EQ(back->force_N, sample.force_N);
  EXPECT_EQ(back->tip_mm, sample.tip_mm);
  EXPECT_EQ(back->frame, 9);
  EXPECT_EQ(back->frame_age_us, 40000U);
  EXPECT_FALSE(from_record(std::span(record).first(63)));
  record[30] ^= 1;
  EXPECT_FALSE(from_record(record));
}

TEST(ForceLoop, AnswersWithTheFrameForceOverUdp) {
  Listener listener;
  ForceLoop loop(listener.options, 0.04);
  uint64_t last = 0;
  ForceSample sample;
  for (int i = 0; i < 10; ++i) {
    loop.use(touching_now());
    std::this_thread::sleep_for(20ms);
  }
  do {
    const auto next = listener.next();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->sequence, last + 1);  // in order, none lost on this machine
    last = next->sequence;
    sample = *next;
  } while (!(sample.valid && (force_of(sample) - Vec3(0.1, -0.2, 0.3)).norm() < 1e-3));
  EXPECT_TRUE(sample.in_contact);
  EXPECT_EQ(sample.frame, 7);
}

TEST(ForceLoop, WithoutFramesIsInvalidAtOnceAndAtNothingSoon) {
  Listener listener;
  ForceLoop loop(listener.options, 0.04);
  for (int i = 0; i < 10; ++i) {
    loop.use(touching_now());
    std::this_thread::sleep_for(20ms);
  }
  ASSERT_TRUE(test::soon([&] { return loop.newest().frames_late; }));
  EXPECT_FALSE(loop.newest().valid);
  EXPECT_TRUE(test::soon([&] { return force_of(loop.newest()).norm() == 0; }));
  // Once invalid, never valid again, and never a greater force.
  double last_N = 1;
  bool late = false;
  for (ForceSample sample; !late || last_N > 0; last_N = late ? force_of(sample).norm() : 1) {
    const auto next = listener.next();
    ASSERT_TRUE(next);
    sample = *next;
    if (!late && sample.sequence > 50) late = sample.frames_late;
    if (!late) continue;
    EXPECT_FALSE(sample.valid);
    EXPECT_LE(force_of(sample).norm(), last_N + 1e-6);
  }
}

TEST(ForceLoop, FollowsATipThatKinematicsTell) {
  Listener listener;
  ForceLoop loop(listener.options, 0.04);
  const Vec3 moved_mm(0, 0, 0.5);
  const auto come = [&] {
    ContactSpring spring = touching_now();
    spring.has_kinematic_tip = true;
    spring.kinematic_tip_mm = {100, 0, 0};  // its own offset from the patch cancels
    loop.use(spring);
    const Vec3 now_mm = spring.kinematic_tip_mm + moved_mm;
    loop.use(KinematicTip{true, steady_ns(), {now_mm.x(), now_mm.y(), now_mm.z()}});
  };
  EXPECT_TRUE(test::soon([&] {
    come();
    return (force_of(loop.newest()) - Vec3(0.1, -0.2, 0.4)).norm() < 1e-3;
  }));
  // Frames go on, the track does not.
  EXPECT_TRUE(test::soon([&] {
    ContactSpring spring = touching_now();
    spring.has_kinematic_tip = true;
    loop.use(spring);
    return !loop.newest().valid;
  }));
}

TEST(ForceLoop, AnAddressThatIsNoneIsOneSentence) {
  ForceLoopOptions options;
  for (const char* udp : {"", "localhost", "127.0.0.1:", "127.0.0.1:99999", ":18945", "no.such.host.invalid:18945"}) {
    options.udp = udp;
    try {
      const ForceLoop loop(options, 0.04);
      ADD_FAILURE() << udp;
    } catch (const BadInput& error) {
      EXPECT_NE(std::string(error.what()).find("streams.force_loop.udp"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace palpate
