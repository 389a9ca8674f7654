#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "palpate/stream/address.h"
#include "palpate/stream/igtl_reader.h"

namespace palpate {

/// `instrument.track: openigtlink:HOST:PORT/DEVICE`: the TRANSFORM of DEVICE from the server at HOST:PORT; without
/// HOST:PORT (`openigtlink:/DEVICE`) as a client sends it to `streams.openigtlink`.
struct TrackSource {
  std::optional<Address> server;
  std::string device;
};

/// Throws BadInput that begins with "instrument.track".
TrackSource parse_track_source(const std::string& track);

/// Reads from an OpenIGTLink server on a thread of its own; connects again, every second, when the connection is gone.
class TrackReceiver {
 public:
  /// `on_transform` is called by that thread. Throws BadInput where the name is not known.
  TrackReceiver(const Address& server, std::function<void(const IgtlReceived&)> on_transform);
  ~TrackReceiver();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
