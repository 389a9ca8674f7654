#include "palpate/stereo/onnx_file.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

namespace palpate {

std::string first_line(const cv::Exception& error) {
  return error.err.substr(0, error.err.find('\n'));
}

cv::dnn::Net read_onnx(const std::filesystem::path& file, const std::function<void(const std::string& why)>& refuse) {
  if (!std::filesystem::is_regular_file(file)) refuse("there is no such file");
  cv::dnn::Net network;
  try {
    network = cv::dnn::readNetFromONNX(file.string());
  } catch (const cv::Exception& error) {
    refuse(fmt::format("the network cannot be read ({})", first_line(error)));
  }
  const std::vector<std::string> outputs = network.getUnconnectedOutLayersNames();
  if (outputs.size() != 1)
    refuse(fmt::format("the network has {} outputs ({})", outputs.size(), fmt::join(outputs, ", ")));
  return network;
}

}  // namespace palpate
