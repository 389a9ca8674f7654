#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// Pictures of one moment.
struct LivePair {
  cv::Mat left;          ///< or both cameras in one picture; empty: the source gives none
  cv::Mat right;         ///< empty where that camera shows nothing of the moment
  int64_t stamp_ns = 0;  ///< as its source counts, from a moment near that of the steady clock
  int64_t taken_ns = 0;  ///< steady clock, as far as it is known: sources with a clock of their own are taken to be as
                         ///< quick as their quickest picture
};

/// A picture of one camera with the stamp that its source gave it.
struct StampedPicture {
  cv::Mat image;
  int64_t stamp_ns = 0;
  int64_t came_ns = 0;              ///< steady clock
  std::optional<int64_t> clock_ns;  ///< stamp + this = steady clock, where the source stamps by our own clock
};

/// Pairs the pictures of two cameras by stamp while they come in, one of them perhaps later than the other. A pair is
/// settled when both pictures are there, or when it is sure that the right one does not come: the right camera has
/// shown a later moment, or nothing for long.
class LivePairing {
 public:
  explicit LivePairing(bool has_right) : has_right_(has_right) {}

  void add_left(StampedPicture picture);
  void add_right(StampedPicture picture);

  /// What has been settled since it was last asked for, in order of time.
  std::vector<LivePair> settled(int64_t now_ns);

  /// A camera that shows nothing for so long is silent.
  int64_t silence_ns() const;

 private:
  struct Picture {
    cv::Mat image;
    int64_t stamp_ns = 0;
  };
  struct Camera {
    std::deque<Picture> waiting;
    std::optional<int64_t> clock_ns;  ///< stamp of the source + this = ours
    std::optional<int64_t> last_stamp_ns, last_came_ns;
  };
  void add(Camera& camera, const Camera& other, StampedPicture picture);

  int64_t step_ns() const;

  Camera left_, right_;
  bool has_right_;
  int64_t ahead_ns_ = 0;          ///< most by which a stamp was later than its picture came
  std::deque<int64_t> steps_ns_;  ///< the last ones of the left camera
};

}  // namespace palpate
