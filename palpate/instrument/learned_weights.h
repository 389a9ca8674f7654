#pragma once

#include <string_view>

namespace palpate {

/// The network that training/ made, as an ONNX file's bytes.
std::string_view learned_weights();

}  // namespace palpate
