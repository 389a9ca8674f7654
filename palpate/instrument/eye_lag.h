#pragma once

#include <deque>
#include <optional>

namespace palpate {

/// Notices that one eye shows another moment than the other: on its way up or down the image, the instrument's tip then
/// lies in other rows of the two eyes, and the rows agree again when one eye is moved by a frame.
class EyeLag {
 public:
  /// Rows of the tip in both eyes, px, in frame `index`.
  void add(int index, double left_row_px, double right_row_px);

  /// Frames by which the right eye is ahead of the left one, -1, 0 or 1; nothing while the tip has not moved enough
  /// across the rows to tell.
  std::optional<int> frames() const;

 private:
  struct Rows {
    double left_px, right_px;
  };
  std::deque<Rows> recent_;
  int last_index_ = 0;
};

}  // namespace palpate
