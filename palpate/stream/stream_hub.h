#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/instrument/instrument_tracker.h"
#include "palpate/stream/force_loop.h"
#include "palpate/stream/igtl_server.h"
#include "palpate/stream/stream_frame.h"
#include "palpate/stream/stream_options.h"

namespace palpate {

/// Every stream that the scene file switches on. The frame loop publishes each frame in one place and never waits.
class StreamHub {
 public:
  /// `instrument`: its live track is listened to, where it has one. Throws BadInput: a port that is taken, a name that
  /// is not known, a modulus that is unknown.
  StreamHub(const StreamOptions& options, const StreamScene& scene, const InstrumentOptions& instrument = {});
  ~StreamHub();
  StreamHub(StreamHub&&) noexcept;

  /// For `InstrumentOptions::live_tip`; empty where there is no live track.
  std::function<std::optional<TipTrack::Row>()> live_tip() const;

  /// `decoded_ns`: steady clock (clock.h), when both pictures of the frame were there.
  void publish(const ForceEstimate& estimate, const cv::Mat& overlay, int64_t decoded_ns);

  /// What did not go as asked, for the user.
  std::vector<std::string> notes() const;
  /// What was sent, one line for each stream.
  std::vector<std::string> summary() const;

  /// Nothing where the stream is off.
  const ForceLoop* force_loop() const;
  const IgtlServer* openigtlink() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
