#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace palpate {

struct PictureQualityParameters {
  double obscured_contrast = 0.6;  ///< of the map frame's contrast; less: smoke, blur or darkness hides the scene
  double min_noise_levels = 0.02;  ///< mean grey level difference by which two pictures of a camera always differ
};

/// What a picture is worth, whatever it shows.
struct PictureQuality {
  bool repeated = false;  ///< a duplicate of the frame before: it says nothing new
  bool obscured = false;  ///< smoke, blur or darkness: nothing in it can be trusted
};

/// Compares each picture with the map frame and with the one before.
class PictureWatch {
 public:
  explicit PictureWatch(const cv::Mat& map_left_bgr, const PictureQualityParameters& parameters = {});
  PictureQuality update(const cv::Mat& left_bgr, const cv::Mat& right_bgr);

 private:
  PictureQualityParameters parameters_;
  double map_contrast_ = 0;
  std::array<cv::Mat, 2> last_;  ///< every fourth pixel; a copy, because grabbers use their buffers again
};

}  // namespace palpate
