#pragma once

#include <cstddef>
#include <vector>

#include "palpate/instrument/instrument_finder.h"

namespace palpate {

/// What one camera shows in both ways, in the same frame.
struct BothWays {
  FoundInstruments by_colours, by_network;
};

/// Which way outlines the instruments, the same in all cameras: outlines of different ways do not end at the same
/// point. The colours draw the sharper outline; our network knows more kinds of pictures. So it draws where the colours
/// find nothing, or something else. Most frames are looked at in one way, now and then one in both.
class WayChoice {
 public:
  bool by_colours() const { return by_colours_; }
  /// Whether the next frame is to be looked at in both ways.
  bool compares() const { return !known_ || frames_alone_ >= kFramesAlone; }
  /// A frame was looked at in the chosen way; false: something that was there is missing, so both ways are to look.
  bool suffices(const std::vector<FoundInstruments>& found);
  /// While an instrument touches, its displacement is measured against how it looked at the touch: the way stays, as
  /// long as it shows an instrument.
  void keep(bool is_kept) { is_kept_ = is_kept; }
  /// Chooses, by what the cameras show in one frame; `picture_areas` are 255 inside the pictures.
  void compare(const std::vector<BothWays>& cameras, const std::vector<cv::Mat>& picture_areas);

 private:
  static constexpr int kFramesAlone = 4;

  bool known_ = false, by_colours_ = true, sees_any_ = false, is_kept_ = false;
  double agreement_ = 0;  ///< overlap of what both ways found so far
  int frames_alone_ = 0;
};

/// What each camera shows in one frame, a finder for each, in the way that `way` chooses.
std::vector<FoundInstruments> find_instruments_in(const std::vector<cv::Mat>& bgr,
                                                  const std::vector<InstrumentFinder*>& finders, WayChoice& way);

}  // namespace palpate
