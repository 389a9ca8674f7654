#include "palpate/stereo/network.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <limits>
#include <opencv2/dnn.hpp>

#include "palpate/core/errors.h"
#include "palpate/stereo/onnx_file.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {
namespace {

constexpr float kMaxReturn_px = 1;  // left-right check

[[noreturn]] void refuse(const std::filesystem::path& onnx, const std::string& why) {
  throw BadInput(fmt::format(
      "{}: {}; expected an ONNX network with two inputs named left and right (1 x 3 x height x width, RGB from 0 to 1) "
      "and one output, the disparity of the left image in px",
      onnx.string(), why));
}

cv::dnn::Net read_network(const std::filesystem::path& onnx) {
  return read_onnx(onnx, [&onnx](const std::string& why) { refuse(onnx, why); });
}

cv::Mat run(cv::dnn::Net& network, const cv::Mat& left, const cv::Mat& right, const std::filesystem::path& onnx) {
  cv::Mat output;
  try {
    for (const auto& [name, image] : {std::pair{"left", &left}, std::pair{"right", &right}})
      network.setInput(cv::dnn::blobFromImage(*image, 1.0 / 255, {}, {}, true), name);
    output = network.forward();
  } catch (const cv::Exception& error) {
    refuse(onnx, fmt::format("the network does not take the images of {}x{} px ({})", left.cols, left.rows,
                             first_line(error)));
  }
  const std::vector<int> shape(output.size.p, output.size.p + output.dims);
  if (output.total() != left.total() || output.dims < 2 || shape[shape.size() - 2] != left.rows ||
      output.depth() != CV_32F)
    refuse(onnx, fmt::format("the output is {} for images {} high and {} wide", fmt::join(shape, " x "), left.rows,
                             left.cols));
  const cv::Mat disparity(left.size(), CV_32F, output.data);
  if (!cv::checkRange(disparity)) refuse(onnx, "the output is not a number everywhere");
  return disparity.clone();
}

cv::Mat mirrored(const cv::Mat& image) {
  cv::Mat result;
  cv::flip(image, result, 1);
  return result;
}

}  // namespace

cv::Mat disparity_by_network(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const std::filesystem::path& onnx) {
  const QuietOpenCv quiet;
  cv::dnn::Net network = read_network(onnx);
  cv::Mat from_left = run(network, left_bgr, right_bgr, onnx);
  // In a mirror the right camera is the left one.
  const cv::Mat from_right = mirrored(run(network, mirrored(right_bgr), mirrored(left_bgr), onnx));
  for (int y = 0; y < from_left.rows; ++y)
    for (int x = 0; x < from_left.cols; ++x) {
      float& d = from_left.at<float>(y, x);
      const int there = cvRound(static_cast<float>(x) - d);
      const bool seen = there >= 0 && there < from_left.cols;
      if (!seen || std::abs(from_right.at<float>(y, there) - d) > kMaxReturn_px)
        d = std::numeric_limits<float>::quiet_NaN();
    }
  return from_left;
}

}  // namespace palpate
