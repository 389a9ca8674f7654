#pragma once

#include <filesystem>

namespace palpate {

/// Whether a PNG, JPEG, BMP or WebP file ends before its picture does; their decoders fill the rest with grey.
/// False for all other files.
bool is_cut_short(const std::filesystem::path& image);

}  // namespace palpate
