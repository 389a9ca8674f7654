#pragma once

#include <deque>
#include <optional>

namespace palpate {

/// Notices that one camera shows another moment than the other: on its way up or down the image, the instrument's tip
/// then lies in other rows of the two cameras, by as much as it moves from frame to frame.
class StereoSynchronization {
 public:
  /// Rows of the tip in both cameras, px, in frame `index`.
  void add(int index, double left_row_px, double right_row_px);

  /// Frames by which the right camera is ahead of the left one, -1, 0 or 1; nothing where the tip has not moved
  /// unevenly enough across the rows to tell it from their noise.
  std::optional<int> frames() const;

 private:
  struct Rows {
    double left_px, right_px;
  };
  std::deque<Rows> recent_;
  int last_index_ = 0;
};

}  // namespace palpate
