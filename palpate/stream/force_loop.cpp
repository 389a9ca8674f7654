#include "palpate/stream/force_loop.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/stream/address.h"
#include "palpate/stream/hand_over.h"
#include "palpate/stream/passive_force.h"

namespace palpate {

namespace {

constexpr double kWatchdogFrames = 3, kMaxWatchdog_s = 0.3;
constexpr int kFifoPriority = 80;

/// Lateness in steps of 5 us up to 20 ms; written by one thread, read by any.
class LatenessHistogram {
 public:
  void add(int64_t late_ns) {
    const auto bin = static_cast<size_t>(std::clamp<int64_t>(late_ns / kBin_ns, 0, kBins - 1));
    bins_[bin].fetch_add(1, std::memory_order_relaxed);
    if (late_ns > max_ns_.load(std::memory_order_relaxed)) max_ns_.store(late_ns, std::memory_order_relaxed);
  }

  ForceLoopTiming timing() const {
    ForceLoopTiming timing;
    for (const auto& bin : bins_) timing.answers += bin.load(std::memory_order_relaxed);
    timing.late_p50_ms = quantile_ms(timing.answers, 0.5);
    timing.late_p99_ms = quantile_ms(timing.answers, 0.99);
    timing.late_p999_ms = quantile_ms(timing.answers, 0.999);
    timing.late_max_ms = static_cast<double>(max_ns_.load(std::memory_order_relaxed)) * 1e-6;
    return timing;
  }

 private:
  static constexpr int64_t kBin_ns = 5000, kBins = 4000;

  double quantile_ms(uint64_t count, double fraction) const {
    const double wanted = fraction * static_cast<double>(count);
    double below = 0;
    for (size_t i = 0; i < kBins; ++i) {
      below += static_cast<double>(bins_[i].load(std::memory_order_relaxed));
      if (below >= wanted) return static_cast<double>((static_cast<int64_t>(i) + 1) * kBin_ns) * 1e-6;
    }
    return 0;
  }

  std::array<std::atomic<uint32_t>, kBins> bins_{};
  std::atomic<int64_t> max_ns_{0};
};

Vec3 to_vec3(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

std::array<float, 3> to_floats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

struct ForceLoop::State {
  ForceLoopOptions options;
  int64_t watchdog_ns;
  SocketAddress to;
  Descriptor socket;
  HandOver<ContactSpring> springs;
  HandOver<KinematicTip> tips;
  Broadcast<ForceSample> newest;
  LatenessHistogram lateness;
  std::atomic<uint64_t> missed{0};
  std::atomic<bool> stop{false};
  std::string note;
  std::thread thread;

  // Of the loop's thread alone.
  PassiveForce force;
  ForceSample sample;
  int64_t last_ns = 0, frame_came_ns = 0;

  State(const ForceLoopOptions& o, double frame_s)
      : options(o),
        watchdog_ns(static_cast<int64_t>(1e9 * std::min(kWatchdogFrames * frame_s, kMaxWatchdog_s))),
        to(resolve(parse_address(o.udp, "streams.force_loop.udp"), SOCK_DGRAM, "streams.force_loop.udp")),
        socket(::socket(to.storage.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)),
        force({o.max_force_N, o.max_rate_N_per_s}) {
    if (!socket) throw BadInput(fmt::format("streams.force_loop.udp: {}", std::strerror(errno)));
  }

  void ask_for_fifo() {
    sched_param priority{};
    priority.sched_priority = kFifoPriority;
    if (const int error = pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &priority); error != 0)
      note = fmt::format("streams.force_loop.fifo: SCHED_FIFO is refused ({}), the loop runs as an ordinary thread",
                         std::strerror(error));
  }

  void send() const {
    const ForceRecord record = to_record(sample);
    // Lost where nobody listens or the network is down; the next one follows in a millisecond.
    sendto(socket.get(), record.data(), record.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
           reinterpret_cast<const sockaddr*>(&to.storage), to.size);
  }

  /// From the newest spring and tip. Called by the loop's thread only.
  void answer(int64_t now_ns) {
    bool fresh = false;
    const ContactSpring& spring = springs.read(&fresh);
    if (fresh) {
      force.use(spring);
      frame_came_ns = now_ns;
    }
    const KinematicTip& tip = tips.read();
    bool alive = frame_came_ns != 0 && now_ns - frame_came_ns < watchdog_ns;
    sample.frames_late = !alive;
    const int64_t age_ns = std::max<int64_t>(0, now_ns - spring.decoded_ns);
    Vec3 moved_mm = 1e-9 * static_cast<double>(std::min(age_ns, watchdog_ns)) * spring.tip_velocity_mm_per_s;
    Vec3 tip_mm = spring.tip_mm + moved_mm;
    if (spring.has_kinematic_tip) {
      alive = alive && tip.known && now_ns - tip.arrived_ns < kTipLasts_ns;
      tip_mm = tip.known ? to_vec3(tip.tip_mm) : spring.kinematic_tip_mm;
      moved_mm = tip_mm - spring.kinematic_tip_mm;
    }
    const double seconds = 1e-9 * static_cast<double>(now_ns - last_ns);
    const SteppedForce step = force.step(tip_mm, moved_mm, alive, seconds);
    last_ns = now_ns;

    ++sample.sequence;
    sample.wall_ns = wall_ns();
    sample.valid = step.valid;
    sample.in_contact = step.valid && spring.in_contact;
    sample.limited = step.limited;
    sample.damped = step.damped;
    sample.force_N = to_floats(step.force_N);
    sample.tip_mm = to_floats(tip_mm);
    sample.stiffness_N_per_mm = static_cast<float>(spring.tangent.stiffness_N_per_mm.norm());
    sample.frame = spring.frame;
    sample.frame_age_us = static_cast<uint32_t>(std::min<int64_t>(age_ns / 1000, UINT32_MAX));
  }

  void run() {
    prctl(PR_SET_TIMERSLACK, 1000UL);
    pthread_setname_np(pthread_self(), "palpate-force");
    const auto period_ns = static_cast<int64_t>(1e9 / options.rate_hz);
    int64_t next_ns = steady_ns() + period_ns;
    last_ns = next_ns - period_ns;
    while (!stop.load(std::memory_order_relaxed)) {
      const timespec until{next_ns / 1'000'000'000, next_ns % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      const int64_t now_ns = steady_ns();
      lateness.add(now_ns - next_ns);
      answer(now_ns);
      newest.write(sample);
      send();
      next_ns += period_ns;
      if (const int64_t over_ns = steady_ns() - next_ns; over_ns > 0) {
        const int64_t ticks = over_ns / period_ns;
        missed.fetch_add(static_cast<uint64_t>(ticks), std::memory_order_relaxed);
        next_ns += ticks * period_ns;
      }
    }
  }
};

ForceLoop::ForceLoop(const ForceLoopOptions& options, double frame_s)
    : state_(std::make_unique<State>(options, frame_s)) {
  state_->thread = std::thread([this] { state_->run(); });
  if (options.fifo) state_->ask_for_fifo();
}

ForceLoop::~ForceLoop() {
  state_->stop = true;
  state_->thread.join();
}

void ForceLoop::use(const ContactSpring& spring) {
  state_->springs.write(spring);
}

void ForceLoop::use(const KinematicTip& tip) {
  state_->tips.write(tip);
}

ForceSample ForceLoop::newest() const {
  return state_->newest.read();
}

ForceLoopTiming ForceLoop::timing() const {
  ForceLoopTiming timing = state_->lateness.timing();
  timing.missed = state_->missed.load();
  return timing;
}

std::string ForceLoop::note() const {
  return state_->note;
}

}  // namespace palpate
