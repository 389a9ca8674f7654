#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "palpate/stream/contact_spring.h"
#include "palpate/stream/force_record.h"
#include "palpate/stream/stream_options.h"

namespace palpate {

/// A kinematic tip that is older than this is no tip.
inline constexpr int64_t kTipLasts_ns = 100'000'000;

/// A tip that comes from a robot's kinematics, left camera frame.
struct KinematicTip {
  bool known = false;
  int64_t arrived_ns = 0;  ///< steady clock
  std::array<double, 3> tip_mm{};
};

/// How late the answers of a force loop were, over its life.
struct ForceLoopTiming {
  uint64_t answers = 0;
  uint64_t missed = 0;  ///< answers left out because their time was over
  double late_p50_ms = 0, late_p99_ms = 0, late_p999_ms = 0, late_max_ms = 0;
};

/// A thread that answers at 1 kHz from the springs that the frame loop hands over, for the tip as predicted since the
/// frame, or as kinematics tell it. No lock on its way. Watchdog: without a new frame for three frame times or 300 ms,
/// whichever is less, its answers are invalid at once and the force ramps to zero.
class ForceLoop {
 public:
  /// `frame_s`: time between two frames. Throws BadInput.
  ForceLoop(const ForceLoopOptions& options, double frame_s);
  ~ForceLoop();

  /// From the frame loop's thread.
  void use(const ContactSpring& spring);
  /// From the thread that receives the track.
  void use(const KinematicTip& tip);

  /// The newest answer, from any thread.
  ForceSample newest() const;
  ForceLoopTiming timing() const;
  /// What did not go as asked, or "".
  std::string note() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
