#include "palpate/stereo/live_stereo.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "palpate/core/clock.h"

namespace palpate {

namespace {

constexpr auto kLook = std::chrono::milliseconds(20);
/// Time goes on, also where a source comes back with pictures of the time in which it was silent.
constexpr int64_t kMinStep_ns = 1'000'000;

}  // namespace

LiveStereo::LiveStereo(const std::vector<LiveCameras::Camera>& cameras)
    : pairing_(cameras.size() > 1),
      cameras_(cameras, {[this](size_t camera, StampedPicture picture) { take(camera, std::move(picture)); },
                         [this] {
                           const std::lock_guard lock(mutex_);
                           ended_ = true;
                           came_.notify_all();
                         }}) {}

void LiveStereo::take(size_t camera, StampedPicture picture) {
  const std::lock_guard lock(mutex_);
  if (camera == 0)
    pairing_.add_left(std::move(picture));
  else
    pairing_.add_right(std::move(picture));
  settle();
}

void LiveStereo::settle() {
  for (LivePair& pair : pairing_.settled(steady_ns())) {
    if (listener_) listener_(pair);
    if (newest_) ++dropped_;
    newest_ = std::move(pair);
    came_.notify_all();
  }
}

std::optional<LivePair> LiveStereo::next() {
  std::unique_lock lock(mutex_);
  const int64_t asked_ns = steady_ns();
  while (true) {
    settle();
    const int64_t silent_since_ns = steady_ns() - pairing_.silence_ns();
    if (!newest_ && !ended_ && silent_since_ns <= asked_ns) {
      came_.wait_for(lock, kLook);
      continue;
    }
    if (!newest_ && ended_) return std::nullopt;
    LivePair pair =
        newest_ ? *std::exchange(newest_, std::nullopt) : LivePair{{}, {}, silent_since_ns, silent_since_ns};
    last_stamp_ns_ = pair.stamp_ns = std::max(pair.stamp_ns, last_stamp_ns_ + kMinStep_ns);
    return pair;
  }
}

int LiveStereo::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

void LiveStereo::listen(std::function<void(const LivePair&)> listener) {
  const std::lock_guard lock(mutex_);
  listener_ = std::move(listener);
}

}  // namespace palpate
