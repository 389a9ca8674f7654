#pragma once

#include <deque>
#include <optional>

#include "palpate/core/geometry.h"

namespace palpate {

/// Decides when a free tip begins to touch (Eq. 4 with hysteresis): armed within the threshold of the surface, widened
/// by the tip's deviation; the contact begins when an approaching tip comes to rest there, or when it is surely inside.
/// A tip on its way through the armed zone does not touch yet: counting its displacement from there would preload the
/// tissue.
class OnsetDetector {
 public:
  explicit OnsetDetector(double threshold_mm) : threshold_mm_(threshold_mm) {}

  /// `gap_mm`: signed distance of the tip to the surface; `gap_deviation_mm`: one standard deviation of it; `tip_mm`:
  /// in the left camera frame. True in the frame in which the contact begins. Call once per frame while the tip is
  /// free.
  bool update(double gap_mm, double gap_deviation_mm, const Vec3& tip_mm);

  /// The contact that has just begun was too early: the tip had not come to rest yet. False when the tip is away from
  /// the surface by now, or when that has been so too often for it to touch at all.
  bool may_begin_again(double gap_mm);
  /// A frame without the tip. After some of them what it did before says nothing about what comes; until then the way
  /// across the gap is part of its approach.
  void lose();
  /// The tip has let go at `tip_mm` and has to leave that place before it can touch again.
  void let_go(const Vec3& tip_mm);

 private:
  void start_again();

  double threshold_mm_;
  std::optional<Vec3> let_go_at_mm_;
  std::deque<Vec3> recent_tips_;
  int frames_inside_ = 0;
  int times_too_early_ = 0;
  int lost_frames_ = 0;
};

}  // namespace palpate
