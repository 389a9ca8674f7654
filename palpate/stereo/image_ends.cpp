#include "palpate/stereo/image_ends.h"

#include <cstdint>
#include <string>
#include <string_view>

#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

using namespace std::string_view_literals;

unsigned byte_at(std::string_view bytes, size_t at) {
  return static_cast<unsigned char>(bytes[at]);
}

uint64_t little_endian_at(std::string_view bytes, size_t at) {
  return byte_at(bytes, at) | byte_at(bytes, at + 1) << 8 | byte_at(bytes, at + 2) << 16 |
         static_cast<uint64_t>(byte_at(bytes, at + 3)) << 24;
}

/// From marker to marker: a small picture inside a segment has an end of its own.
bool jpeg_has_end(std::string_view bytes) {
  constexpr unsigned kEnd = 0xD9, kWithoutLength = 0xD0, kLastWithoutLength = 0xD8, kTemporary = 1;
  for (size_t at = 2; at + 1 < bytes.size();) {
    const unsigned marker = byte_at(bytes, at + 1);
    if (byte_at(bytes, at) != 0xFF || marker == 0xFF) {
      ++at;
    } else if (marker == kEnd) {
      return true;
    } else if (marker <= kTemporary || (marker >= kWithoutLength && marker <= kLastWithoutLength)) {
      at += 2;
    } else {
      if (at + 3 >= bytes.size()) return false;
      at += 2 + (byte_at(bytes, at + 2) << 8 | byte_at(bytes, at + 3));
    }
  }
  return false;
}

}  // namespace

bool is_cut_short(const std::filesystem::path& image) {
  const std::string bytes = read_whole_file(image);
  const std::string_view view = bytes;
  constexpr size_t kHead = 12;
  if (view.size() < kHead) return false;
  if (view.starts_with("\xFF\xD8\xFF"sv)) return !jpeg_has_end(view);
  if (view.starts_with("\x89PNG"sv)) return view.find("IEND"sv) == std::string_view::npos;
  if (view.starts_with("RIFF"sv) && view.substr(8, 4) == "WEBP"sv) return little_endian_at(view, 4) + 8 > view.size();
  if (view.starts_with("BM"sv)) return little_endian_at(view, 2) > view.size();
  return false;
}

}  // namespace palpate
