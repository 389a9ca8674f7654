#include "palpate/stereo/live_pairing.h"

#include <algorithm>
#include <cstdlib>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

/// Stamps that are further from the time at which their pictures come count by another clock.
constexpr int64_t kSameClock_ns = 1'000'000'000;
constexpr size_t kMaxWaiting = 32, kStepsKept = 15;
constexpr int64_t kUsualStep_ns = 40'000'000, kSilence_ns = 300'000'000;

}  // namespace

int64_t LivePairing::step_ns() const {
  if (steps_ns_.empty()) return kUsualStep_ns;
  std::vector<int64_t> steps(steps_ns_.begin(), steps_ns_.end());
  return median_of(steps);
}

int64_t LivePairing::silence_ns() const {
  return std::max(kSilence_ns, 3 * step_ns());
}

void LivePairing::add_left(StampedPicture picture) {
  const std::optional<int64_t> before_ns = left_.last_stamp_ns;
  add(left_, right_, std::move(picture));
  if (!before_ns || left_.last_stamp_ns == before_ns) return;
  steps_ns_.push_back(*left_.last_stamp_ns - *before_ns);
  if (steps_ns_.size() > kStepsKept) steps_ns_.pop_front();
}

void LivePairing::add_right(StampedPicture picture) {
  add(right_, left_, std::move(picture));
}

void LivePairing::add(Camera& camera, const Camera& other, StampedPicture picture) {
  const auto is_of = [&](const std::optional<int64_t>& clock_ns) {
    return clock_ns && std::abs(picture.came_ns - picture.stamp_ns - *clock_ns) < kSameClock_ns;
  };
  // A source that was away may count anew; both cameras of one sender count by the same clock.
  if (is_of(picture.clock_ns)) {
    camera.clock_ns = picture.clock_ns;
  } else if (!is_of(camera.clock_ns)) {
    camera.clock_ns = is_of(other.clock_ns) ? other.clock_ns : picture.came_ns - picture.stamp_ns;
    ahead_ns_ = 0;
  }
  const int64_t stamp_ns = picture.stamp_ns + *camera.clock_ns;
  ahead_ns_ = std::max(ahead_ns_, stamp_ns - picture.came_ns);
  camera.last_came_ns = picture.came_ns;
  if (camera.last_stamp_ns && stamp_ns <= *camera.last_stamp_ns) return;
  camera.last_stamp_ns = stamp_ns;
  camera.waiting.push_back({std::move(picture.image), stamp_ns});
  if (camera.waiting.size() > kMaxWaiting) camera.waiting.pop_front();
}

std::vector<LivePair> LivePairing::settled(int64_t now_ns) {
  std::vector<LivePair> pairs;
  std::deque<Picture>&lefts = left_.waiting, &rights = right_.waiting;
  const int64_t reach_ns = step_ns() / 2;
  while (!lefts.empty()) {
    const int64_t stamp_ns = lefts.front().stamp_ns;
    while (!rights.empty() && rights.front().stamp_ns < stamp_ns - reach_ns) rights.pop_front();
    const bool is_there = !rights.empty() && rights.front().stamp_ns <= stamp_ns + reach_ns;
    const int64_t quiet_since_ns = right_.last_came_ns.value_or(stamp_ns);
    const bool may_come = has_right_ && rights.empty() && now_ns - quiet_since_ns < silence_ns();
    if (!is_there && may_come) break;
    LivePair pair{std::move(lefts.front().image), {}, stamp_ns, stamp_ns - ahead_ns_};
    lefts.pop_front();
    if (is_there) {
      pair.right = std::move(rights.front().image);
      rights.pop_front();
    }
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

}  // namespace palpate
