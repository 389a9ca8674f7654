#include "palpate/instrument/segmentation_network.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "palpate/core/errors.h"
#include "palpate/stereo/onnx_file.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& onnx, const std::string& why) {
  throw BadInput(fmt::format(
      "instrument.segmentation: {}: {}; expected an ONNX network with one input (1 x 3 x height x width, RGB "
      "from 0 to 1) and one output (1 x classes x height x width)",
      onnx.string(), why));
}

cv::dnn::Net read_network(const std::filesystem::path& onnx) {
  return read_onnx(onnx, [&onnx](const std::string& why) { refuse(onnx, why); });
}

/// Size of the images that the file asks for; `otherwise` where it leaves that open.
cv::Size input_size(const cv::dnn::Net& network, cv::Size otherwise) {
  try {
    std::vector<cv::dnn::MatShape> in, out;
    network.getLayerShapes(cv::dnn::MatShape(), 0, in, out);
    if (!out.empty() && out[0].size() == 4 && out[0][2] > 1 && out[0][3] > 1) return {out[0][3], out[0][2]};
  } catch (const cv::Exception&) {  // the shapes are not known before an image is
  }
  return otherwise;
}

}  // namespace

struct SegmentationNetwork::Network {
  std::filesystem::path onnx;
  cv::dnn::Net net;
  int instrument_class = 0;
  cv::Size size;  ///< of its input

  cv::Mat scores(const cv::Mat& bgr) {
    try {
      net.setInput(cv::dnn::blobFromImage(bgr, 1.0 / 255, size, {}, true));
      return net.forward();
    } catch (const cv::Exception& error) {
      refuse(onnx, fmt::format("the network does not take images of {} x {} px ({})", size.width, size.height,
                               first_line(error)));
    }
  }
};

SegmentationNetwork::SegmentationNetwork(const std::filesystem::path& onnx, int instrument_class, cv::Size size)
    : network_(std::make_unique<Network>()) {
  const QuietOpenCv quiet;
  network_->onnx = onnx;
  network_->net = read_network(onnx);
  network_->instrument_class = instrument_class;
  network_->size = input_size(network_->net, size);
  const cv::Mat scores = network_->scores(cv::Mat(size, CV_8UC3, cv::Scalar::all(128)));
  const std::vector<int> shape(scores.size.p, scores.size.p + scores.dims);
  if (shape.size() != 4 || shape[0] != 1 || shape[2] < 2 || shape[3] < 2 || scores.depth() != CV_32F)
    refuse(onnx, fmt::format("the output is {}", fmt::join(shape, " x ")));
  if (shape[1] > 1 && instrument_class >= shape[1])
    throw BadInput(fmt::format("instrument.class is {}, but {} has the classes 0 to {}", instrument_class,
                               onnx.string(), shape[1] - 1));
}

SegmentationNetwork::~SegmentationNetwork() = default;
SegmentationNetwork::SegmentationNetwork(SegmentationNetwork&&) noexcept = default;
SegmentationNetwork& SegmentationNetwork::operator=(SegmentationNetwork&&) noexcept = default;

cv::Mat SegmentationNetwork::mask(const cv::Mat& bgr) const {
  const cv::Mat scores = network_->scores(bgr);
  const int classes = scores.size[1];
  const auto channel = [&](int c) {
    return cv::Mat(scores.size[2], scores.size[3], CV_32F, const_cast<float*>(scores.ptr<float>(0, c)));
  };
  cv::Mat above;  // positive where the instrument is
  if (classes == 1) {
    double least = 0, most = 0;
    cv::minMaxLoc(channel(0), &least, &most);
    const bool probabilities = least >= 0 && most <= 1;
    above = channel(0) - (probabilities ? 0.5 : 0.0);
  } else {
    cv::Mat best_other;
    for (int c = 0; c < classes; ++c) {
      if (c == network_->instrument_class) continue;
      best_other = best_other.empty() ? channel(c).clone() : cv::Mat(cv::max(best_other, channel(c)));
    }
    above = channel(network_->instrument_class) - best_other;
  }
  cv::resize(above, above, bgr.size(), 0, 0, cv::INTER_LINEAR);
  return above > 0;
}

}  // namespace palpate
