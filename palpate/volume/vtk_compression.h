#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// Base64 up to the first character that is none; header and data may be padded apart, as VTK does.
std::string from_base64(std::string_view text);

/// One array of a VTK XML file: its header in front tells the length, or the blocks that a compressor made.
/// `compressor` is the name that the file states, "" = none. Throws BadInput: cut short, unknown compressor.
std::string unpacked(std::string_view bytes, const std::string& compressor, size_t header_bytes, bool big_endian);

}  // namespace palpate
