#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace palpate {

/// Watches whether the picture still shows the scene from where the map was built: a bumped camera, or a patient who
/// was moved, moves everything at once; an instrument moves what is near it.
class MapWatch {
 public:
  /// `static_left`: rectified left image of the map frame; `instrument`: 255 = what was in view then.
  MapWatch(const cv::Mat& static_left, const cv::Mat& instrument);

  struct Answer {
    int points = 0;             ///< of the map frame that are found again
    double found_share = 0;     ///< of those that the instrument leaves free
    double moved_share = 0;     ///< of these, the ones that moved by more than tissue does far from a contact
    double median_px = 0;       ///< of the motion
    bool map_is_stale = false;  ///< the scene is elsewhere, or another one
    bool veiled = false;        ///< smoke, blur or darkness hides the scene: nothing in this picture can be trusted
  };
  Answer update(const cv::Mat& left, const cv::Mat& instrument) const;

 private:
  std::vector<cv::Mat> static_pyramid_;
  double static_contrast_ = 0;
  std::vector<cv::Point2f> corners_;
};

}  // namespace palpate
