#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "palpate/estimate/force_estimate.h"
#include "palpate/stereo/recording.h"

namespace palpate {

struct PlayedFrame {
  StereoFrame frame;
  int64_t taken_ns = 0;      ///< steady clock (palpate/core/clock.h), of a live source by its stamp; else decoded_ns
  int64_t decoded_ns = 0;    ///< when both pictures were there
  bool passed_over = false;  ///< its time is over: the next one is there already
};

/// The frames of a recording, as fast as they are asked for, or at the rate at which they were recorded: then a frame
/// whose time is over is passed over, and where the computer cannot keep up all the same, the clock is slowed down. A
/// live source gives its newest frame.
class Playback {
 public:
  /// `stopped`: asked while it waits.
  Playback(Recording& recording, bool realtime, std::function<bool()> stopped)
      : recording_(recording), realtime_(realtime), stopped_(std::move(stopped)) {}

  /// Waits for the frame's time, not longer than it takes to be stopped.
  std::optional<PlayedFrame> next();

 private:
  Recording& recording_;
  bool realtime_;
  std::function<bool()> stopped_;
  std::optional<int64_t> start_ns_;
  int passed_over_ = 0;  ///< in a row, until now
};

/// The row of a frame that was not looked at, and the warning that says why.
ForceEstimate not_looked_at(const StereoFrame& frame, const std::string& warning);

}  // namespace palpate
