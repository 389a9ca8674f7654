#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/dnn.hpp>
#include <string>

namespace palpate {

/// A network with one output. `refuse` throws: it is told why the file cannot be used.
cv::dnn::Net read_onnx(const std::filesystem::path& file, const std::function<void(const std::string& why)>& refuse);

/// What OpenCV says of an error, without the rest of its lines.
std::string first_line(const cv::Exception& error);

}  // namespace palpate
