#pragma once

#include <functional>
#include <memory>

#include "palpate/stream/force_record.h"
#include "palpate/stream/igtl_reader.h"
#include "palpate/stream/stream_frame.h"
#include "palpate/stream/stream_options.h"

namespace palpate {

/// What an OpenIGTLink server has done so far.
struct IgtlServerCounts {
  int clients = 0;        ///< connected now
  int dropped = 0;        ///< took nothing for too long, sent no OpenIGTLink, or came when there were too many
  uint64_t messages = 0;  ///< written in full
  uint64_t bytes = 0;
  uint64_t replaced = 0;                          ///< newer ones took their place before they were begun
  double cpu_s = 0;                               ///< of its thread
  double latency_p50_ms = 0, latency_p99_ms = 0;  ///< frame decoded -> last byte of PalpateTip given to the system
};

/// Serves OpenIGTLink on a thread of its own. Each client has room for one message of each kind: a newer one takes the
/// place of one that is not begun, so that a slow client sees less, not older, and nobody waits for it. A client that
/// asks (GET_POLYDATA, GET_IMAGE, GET_TRANSFORM, GET_STRING, GET_STATUS, GET_SENSOR) gets answers and nothing else from
/// then on.
class IgtlServer {
 public:
  /// `force`: the newest answer of the force loop, or nothing, whose forces then come from the frames; `on_transform`:
  /// called by the server's thread for each TRANSFORM that a client sends. Throws BadInput where the port is taken.
  IgtlServer(const OpenIgtLinkOptions& options, StreamScene scene, std::function<ForceSample()> force,
             std::function<void(const IgtlReceived&)> on_transform);
  ~IgtlServer();

  /// Never waits for a client.
  void publish(SharedFrame frame);
  IgtlServerCounts counts() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
