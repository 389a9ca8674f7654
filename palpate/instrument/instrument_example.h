#pragma once

#include <opencv2/core.hpp>

namespace palpate {

/// The colours of one instrument in one light, against those of all else.
class ExampleColours {
 public:
  /// Learns from one image: `example` is 255 where it surely shows the instrument. `probability` (float, 0 to 1, any
  /// size; may be empty) is what is known without the example.
  ExampleColours(const cv::Mat& bgr, const cv::Mat& example, const cv::Mat& probability);

  /// Learns from what was found in one image: `instrument` (8-bit, of the image's size) is 255 there.
  static ExampleColours of_found(const cv::Mat& bgr, const cv::Mat& instrument);

  /// Probability of the instrument, float, of `probability`'s size, with what the colours say counted in.
  cv::Mat counted_in(const cv::Mat& bgr, const cv::Mat& probability) const;

 private:
  ExampleColours() = default;

  cv::Mat evidence_;  ///< log of the ratio of both frequencies, by bin
};

}  // namespace palpate
