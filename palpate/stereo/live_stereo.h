#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "palpate/stereo/live_cameras.h"
#include "palpate/stereo/live_pairing.h"

namespace palpate {

/// Two cameras, or one that shows both, as they are now: the newest pair wins.
class LiveStereo {
 public:
  /// Left and right, or one that shows both. Throws BadInput.
  explicit LiveStereo(const std::vector<LiveCameras::Camera>& cameras);

  /// The newest pair that was not given yet. Waits for one; a source that is silent for long gives pairs without
  /// pictures meanwhile. Nothing at the end of a source that has one.
  std::optional<LivePair> next();

  cv::Size size() const { return cameras_.size(0); }
  double stated_fps() const { return cameras_.stated_fps(); }
  /// Pairs in whose place a newer one was given.
  int dropped() const;

  /// Every pair from now on, from a thread of its own that must not wait; an empty function ends it.
  void listen(std::function<void(const LivePair&)> listener);

 private:
  void take(size_t camera, StampedPicture picture);
  /// Under the mutex.
  void settle();

  mutable std::mutex mutex_;
  std::condition_variable came_;
  LivePairing pairing_;
  std::optional<LivePair> newest_;
  bool ended_ = false;
  int dropped_ = 0;
  int64_t last_stamp_ns_ = 0;
  std::function<void(const LivePair&)> listener_;
  LiveCameras cameras_;  ///< goes first: it calls us
};

}  // namespace palpate
