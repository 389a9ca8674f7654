#include "palpate/instrument/segmentation_network.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "palpate/core/errors.h"
#include "palpate/instrument/learned_weights.h"
#include "palpate/instrument/onnx_header.h"
#include "palpate/stereo/onnx_file.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {
namespace {

constexpr double kPixels = 320 * 192;  // of our own network's input
constexpr int kMultiple = 32;          // of which the sides of an input of open size are: most networks ask for it
constexpr int kMaxClasses = 256;

[[noreturn]] void refuse(const std::filesystem::path& onnx, const std::string& why) {
  throw BadInput(
      fmt::format("instrument.segmentation: {}: {}; expected an ONNX network with one input (1 x 3 x height x width or "
                  "1 x height x width x 3, RGB) and one output (1 x classes x height x width)",
                  onnx.string(), why));
}

cv::Size learned_input_size(cv::Size image) {
  const double scale = std::sqrt(kPixels / image.area());
  const auto side = [scale](int pixels) { return std::max(1, cvRound(scale * pixels / kMultiple)) * kMultiple; };
  return {side(image.width), side(image.height)};
}

cv::Mat channel_of(const cv::Mat& scores, int channel, bool channels_last) {
  if (!channels_last)
    return cv::Mat(scores.size[2], scores.size[3], CV_32F, const_cast<float*>(scores.ptr<float>(0, channel)));
  const cv::Mat interleaved(scores.size[1], scores.size[2], CV_32FC(scores.size[3]),
                            const_cast<float*>(scores.ptr<float>()));
  cv::Mat result;
  cv::extractChannel(interleaved, result, channel);
  return result;
}

cv::Mat logistic(const cv::Mat& logits) {
  cv::Mat result;
  cv::exp(-logits, result);
  result = 1 / (1 + result);
  return result;
}

}  // namespace

struct SegmentationNetwork::Network {
  std::filesystem::path onnx;
  cv::dnn::Net net;
  NetworkOptions options;
  cv::Size input;    ///< px
  cv::Rect content;  ///< where the image lies in the input
  bool input_channels_last = false;
  bool output_channels_last = false;
  bool probabilities = false;  ///< or logits, or scores

  void read_input_shape(const OnnxHeader& header, cv::Size image);
  void check_output(const cv::Mat& scores);
  cv::Mat blob(const cv::Mat& bgr) const;
  cv::Mat scores(const cv::Mat& bgr);
  cv::Rect content_of(cv::Size output) const;
};

void SegmentationNetwork::Network::read_input_shape(const OnnxHeader& header, cv::Size image) {
  const auto padded = [](int pixels) { return (pixels + kMultiple - 1) / kMultiple * kMultiple; };
  input = {padded(image.width), padded(image.height)};
  content = cv::Rect({(input.width - image.width) / 2, (input.height - image.height) / 2}, image);
  probabilities = header.last_operation == "Sigmoid" || header.last_operation == "HardSigmoid" ||
                  header.last_operation == "Softmax";
  const std::vector<int>& shape = header.input;
  if (shape.size() != 4) return;
  input_channels_last = shape[3] == 3 && shape[1] != 3;
  if (!input_channels_last && shape[1] > 0 && shape[1] != 3)
    refuse(onnx, fmt::format("the input is {}, which has no three channels", fmt::join(shape, " x ")));
  const cv::Size fixed(shape[input_channels_last ? 2 : 3], shape[input_channels_last ? 1 : 2]);
  if (fixed.width <= 0 || fixed.height <= 0) return;
  input = fixed;
  const double scale = std::min(1.0 * fixed.width / image.width, 1.0 * fixed.height / image.height);
  const cv::Size scaled(std::clamp(cvRound(scale * image.width), 1, fixed.width),
                        std::clamp(cvRound(scale * image.height), 1, fixed.height));
  content = cv::Rect({(fixed.width - scaled.width) / 2, (fixed.height - scaled.height) / 2}, scaled);
}

cv::Mat SegmentationNetwork::Network::blob(const cv::Mat& bgr) const {
  cv::Mat scaled, boxed;
  cv::resize(bgr, scaled, content.size(), 0, 0, cv::INTER_AREA);
  cv::copyMakeBorder(scaled, boxed, content.y, input.height - content.br().y, content.x, input.width - content.br().x,
                     cv::BORDER_CONSTANT);
  cv::cvtColor(boxed, boxed, cv::COLOR_BGR2RGB);
  boxed.convertTo(boxed, CV_32F, 1.0 / 255);
  const Eigen::Vector3d &mean = options.mean_rgb, &deviation = options.deviation_rgb;
  cv::subtract(boxed, cv::Scalar(mean.x(), mean.y(), mean.z()), boxed);
  cv::divide(boxed, cv::Scalar(deviation.x(), deviation.y(), deviation.z()), boxed);
  if (!input_channels_last) return cv::dnn::blobFromImage(boxed);
  const int shape[] = {1, input.height, input.width, 3};
  return cv::Mat(4, shape, CV_32F, boxed.data).clone();
}

cv::Mat SegmentationNetwork::Network::scores(const cv::Mat& bgr) {
  try {
    net.setInput(blob(bgr));
    return net.forward();
  } catch (const cv::Exception& error) {
    refuse(onnx, fmt::format("OpenCV {} cannot run it on images of {} x {} px ({})", CV_VERSION, input.width,
                             input.height, first_line(error)));
  }
}

void SegmentationNetwork::Network::check_output(const cv::Mat& scores) {
  const std::vector<int> shape(scores.size.p, scores.size.p + scores.dims);
  const bool is_image = shape.size() == 4 && shape[0] == 1 && scores.depth() == CV_32F;
  if (is_image && shape[3] <= kMaxClasses && shape[3] < shape[1] && shape[3] < shape[2] && shape[2] > 1)
    output_channels_last = true;
  const int classes = !is_image ? 0 : output_channels_last ? shape[3] : shape[1];
  if (!is_image || classes > kMaxClasses || shape[2] < 2 || (!output_channels_last && shape[3] < 2))
    refuse(onnx, fmt::format("the output is {}", fmt::join(shape, " x ")));
  if (classes > 1 && options.instrument_class >= classes)
    throw BadInput(fmt::format("instrument.class is {}, but {} has the classes 0 to {}", options.instrument_class,
                               onnx.string(), classes - 1));
}

/// The image's part of the output.
cv::Rect SegmentationNetwork::Network::content_of(cv::Size output) const {
  const double x = 1.0 * output.width / input.width, y = 1.0 * output.height / input.height;
  const cv::Point from(cvRound(content.x * x), cvRound(content.y * y));
  const cv::Point to(cvRound(content.br().x * x), cvRound(content.br().y * y));
  return cv::Rect(from, to) & cv::Rect({}, output);
}

SegmentationNetwork::SegmentationNetwork(const std::filesystem::path& onnx, const NetworkOptions& options,
                                         cv::Size image)
    : network_(std::make_unique<Network>()) {
  const QuietOpenCv quiet;
  network_->onnx = onnx;
  network_->options = options;
  network_->net = read_onnx(onnx, [&onnx](const std::string& why) { refuse(onnx, why); });
  network_->read_input_shape(read_onnx_header(read_bytes(onnx)), image);
  network_->check_output(network_->scores(cv::Mat(image, CV_8UC3, cv::Scalar::all(128))));
}

SegmentationNetwork::SegmentationNetwork(cv::Size image) : network_(std::make_unique<Network>()) {
  const QuietOpenCv quiet;
  const std::string_view weights = learned_weights();
  network_->onnx = "learned";
  network_->net = cv::dnn::readNetFromONNX(weights.data(), weights.size());
  network_->input = learned_input_size(image);
  network_->content = cv::Rect({}, network_->input);
}

SegmentationNetwork::~SegmentationNetwork() = default;
SegmentationNetwork::SegmentationNetwork(SegmentationNetwork&&) noexcept = default;
SegmentationNetwork& SegmentationNetwork::operator=(SegmentationNetwork&&) noexcept = default;

cv::Mat SegmentationNetwork::probability(const cv::Mat& bgr) const {
  Network& network = *network_;
  const cv::Mat scores = network.scores(bgr);
  const bool last = network.output_channels_last;
  const int classes = scores.size[last ? 3 : 1];
  const cv::Rect content =
      network.content_of(last ? cv::Size(scores.size[2], scores.size[1]) : cv::Size(scores.size[3], scores.size[2]));
  if (classes == 1) {
    const cv::Mat score = channel_of(scores, 0, last)(content);
    // Logits of a whole picture do not all lie between 0 and 1.
    return network.probabilities || cv::checkRange(score, true, nullptr, 0, 1 + 1e-6) ? score.clone() : logistic(score);
  }
  cv::Mat best_other;
  for (int c = 0; c < classes; ++c) {
    if (c == network.options.instrument_class) continue;
    const cv::Mat score = channel_of(scores, c, last);
    best_other = best_other.empty() ? score.clone() : cv::Mat(cv::max(best_other, score));
  }
  const cv::Mat above = cv::Mat(channel_of(scores, network.options.instrument_class, last) - best_other)(content);
  return network.probabilities ? cv::Mat(0.5 + 0.5 * above) : logistic(above);
}

cv::Mat SegmentationNetwork::mask(const cv::Mat& bgr) const {
  cv::Mat likely;
  cv::resize(probability(bgr), likely, bgr.size(), 0, 0, cv::INTER_LINEAR);
  return likely > 0.5;
}

}  // namespace palpate
