#pragma once

#include <memory>

#include "palpate/stream/stream_frame.h"
#include "palpate/stream/stream_options.h"

namespace palpate {

/// Publishes as a node of ROS 2 would, on a thread of its own (docs/streams.md). A force or a tip that is lost is one
/// message with stamp 0, then silence.
class Ros2Publisher {
 public:
  /// Throws BadInput where the domain or the network interface cannot be used.
  explicit Ros2Publisher(const Ros2Options& options);
  ~Ros2Publisher();

  /// Never waits for a reader.
  void publish(SharedFrame frame);
  uint64_t messages() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
