#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>

namespace palpate {

/// A learned network that finds instruments in one eye's images. The file is ONNX with one input, 1 x 3 x height x
/// width, float, RGB from 0 to 1, and one output, 1 x classes x height x width of any size: with one channel the
/// instrument's probability (all values from 0 to 1) or its logit, with several channels scores of which the greatest
/// wins. Images are brought to the input's size where the file states one.
class SegmentationNetwork {
 public:
  /// `instrument_class`: the instrument's channel, from 0, where there are several. Throws BadInput: the file cannot be
  /// read, several outputs, an output of another shape, no such class, or images of `size` do not fit.
  SegmentationNetwork(const std::filesystem::path& onnx, int instrument_class, cv::Size size);
  ~SegmentationNetwork();
  SegmentationNetwork(SegmentationNetwork&&) noexcept;
  SegmentationNetwork& operator=(SegmentationNetwork&&) noexcept;

  /// 255 = instrument, of the image's size.
  cv::Mat mask(const cv::Mat& bgr) const;

 private:
  struct Network;
  std::unique_ptr<Network> network_;
};

}  // namespace palpate
