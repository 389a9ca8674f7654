#include "palpate/session/playback.h"

#include <poll.h>

#include <algorithm>

#include "palpate/core/clock.h"
#include "palpate/instrument/instrument_tracker.h"

namespace palpate {

namespace {

/// In a row: with more the force loop would have to take frames for lost.
constexpr int kMaxPassedOver = 2;

}  // namespace

std::optional<PlayedFrame> Playback::next() {
  std::optional<StereoFrame> frame = recording_.next();
  if (!frame) return std::nullopt;
  PlayedFrame played;
  played.frame = std::move(*frame);
  if (realtime_ && !recording_.is_live()) {
    const auto at_ns = static_cast<int64_t>(1e9 * played.frame.time_s);
    if (!start_ns_) start_ns_ = steady_ns() - at_ns;
    const int64_t due_ns = *start_ns_ + at_ns;
    while (!stopped_() && steady_ns() < due_ns)
      poll(nullptr, 0, static_cast<int>(std::clamp<int64_t>((due_ns - steady_ns()) / 1'000'000, 1, 50)));
    const int64_t late_ns = steady_ns() - due_ns;
    const bool is_over = recording_.fps() > 0 && late_ns > static_cast<int64_t>(1e9 / recording_.fps());
    played.passed_over = is_over && passed_over_ < kMaxPassedOver;
    passed_over_ = played.passed_over ? passed_over_ + 1 : 0;
    // A computer that cannot keep up plays more slowly: it does not pass over everything.
    if (is_over && !played.passed_over) *start_ns_ += late_ns;
  }
  played.decoded_ns = steady_ns();
  played.taken_ns = recording_.is_live() ? recording_.taken_ns() : played.decoded_ns;
  return played;
}

ForceEstimate not_looked_at(const StereoFrame& frame, const std::string& warning) {
  ForceEstimate estimate;
  estimate.frame = frame.index;
  estimate.time_s = frame.time_s;
  estimate.status = FrameStatus::tool_lost;
  estimate.warnings = {warning};
  const ForceEstimate of_any = estimate;
  estimate.further.assign(kMaxInstruments - 1, of_any);
  return estimate;
}

}  // namespace palpate
