#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>

#include "palpate/core/geometry.h"

namespace palpate {

/// How a network's input is made and its output read.
struct NetworkOptions {
  int instrument_class = 1;                                 ///< its channel, from 0, where there are several
  Eigen::Vector3d mean_rgb = Eigen::Vector3d::Zero();       ///< subtracted from RGB from 0 to 1
  Eigen::Vector3d deviation_rgb = Eigen::Vector3d::Ones();  ///< what is left is divided by it
};

/// A learned network that finds instruments in one camera's images. It has one input, 1 x 3 x height x width or
/// 1 x height x width x 3, float, RGB; and one output, 1 x classes x height x width or 1 x height x width x classes, of
/// any size: with one channel the instrument's probability or its logit, with several channels scores (logits or
/// probabilities) of which the greatest wins. Images are scaled to the input's size and letter-boxed; where the file
/// leaves the size open, they are padded to multiples of 32 px.
class SegmentationNetwork {
 public:
  /// The user's. Throws BadInput: the file cannot be read, OpenCV cannot run it (with the layer), several outputs, an
  /// output of another shape, no such class.
  SegmentationNetwork(const std::filesystem::path& onnx, const NetworkOptions& options, cv::Size image);
  /// The project's own (training/), which is compiled in.
  explicit SegmentationNetwork(cv::Size image);
  ~SegmentationNetwork();
  SegmentationNetwork(SegmentationNetwork&&) noexcept;
  SegmentationNetwork& operator=(SegmentationNetwork&&) noexcept;

  /// Probability of an instrument, 0 to 1, float, at the resolution of the network's output.
  cv::Mat probability(const cv::Mat& bgr) const;
  /// 255 = instrument, of the image's size.
  cv::Mat mask(const cv::Mat& bgr) const;

 private:
  struct Network;
  std::unique_ptr<Network> network_;
};

}  // namespace palpate
