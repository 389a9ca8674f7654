#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// What an ONNX file says about itself. OpenCV's importer keeps none of it.
struct OnnxHeader {
  std::vector<int> input;  ///< dimensions of its only image input; 0 where they are left open; empty: none is stated
  std::string last_operation;  ///< of the graph's last node, "Sigmoid"
};

/// Reads the header from a file's bytes. What is no ONNX has an empty header.
OnnxHeader read_onnx_header(std::string_view bytes);

/// The whole file; empty when it cannot be read.
std::string read_bytes(const std::filesystem::path& file);

}  // namespace palpate
