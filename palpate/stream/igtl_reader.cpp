#include "palpate/stream/igtl_reader.h"

#include <igtl_header.h>
#include <igtl_util.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace palpate {

namespace {

constexpr uint64_t kMaxTransform = 4096;  ///< bytes, with metadata
constexpr size_t kMatrixBytes = 48;

std::string text_of(const char* characters, size_t size) {
  return {characters, strnlen(characters, size)};
}

float big_endian_float(const uint8_t* bytes) {
  const uint32_t word = uint32_t{bytes[0]} << 24 | uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 8 | bytes[3];
  return std::bit_cast<float>(word);
}

}  // namespace

bool IgtlReader::header_done() {
  igtl_header header;
  static_assert(sizeof header == 58);
  std::memcpy(&header, kept_.data(), sizeof header);
  igtl_header_convert_byte_order(&header);
  message_ = {};
  message_.type = text_of(header.name, sizeof header.name);
  message_.device = text_of(header.device_name, sizeof header.device_name);
  const bool is_word = std::all_of(message_.type.begin(), message_.type.end(),
                                   [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; });
  if (header.version < 1 || header.version > 3 || message_.type.empty() || !is_word) return false;
  version_ = header.version;
  crc_ = header.crc;
  const bool is_transform =
      message_.type == "TRANSFORM" && header.body_size >= kMatrixBytes && header.body_size <= kMaxTransform;
  if (message_.type == "TRANSFORM" && !is_transform) message_.type = "TRANSFORM of another size";
  wanted_ = is_transform ? header.body_size : 0;
  to_skip_ = is_transform ? 0 : header.body_size;
  return true;
}

/// The matrix, column by column; false where it is not to be trusted.
bool IgtlReader::body_done() {
  if (crc64(kept_.data(), kept_.size(), 0) != crc_) return false;
  // From version 2 on an extended header, which begins with its own size, stands before the content.
  size_t at = 0;
  if (version_ >= 2) at = size_t{kept_[0]} << 8 | kept_[1];
  if (at + kMatrixBytes > kept_.size()) return false;
  std::array<double, 12> numbers;
  for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = big_endian_float(kept_.data() + at + 4 * i);
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      (column < 3 ? message_.rotation(row, column) : message_.translation_mm[row]) =
          numbers[static_cast<size_t>(3 * column + row)];
  return message_.rotation.allFinite() && message_.translation_mm.allFinite();
}

bool IgtlReader::read(std::span<const uint8_t> bytes, const std::function<void(const IgtlReceived&)>& on_message) {
  while (true) {
    const auto skipped = std::min<uint64_t>(to_skip_, bytes.size());
    to_skip_ -= skipped;
    bytes = bytes.subspan(skipped);
    const auto taken = std::min<uint64_t>(wanted_ - std::min<uint64_t>(wanted_, kept_.size()), bytes.size());
    kept_.insert(kept_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(taken));
    bytes = bytes.subspan(taken);
    if (to_skip_ > 0 || kept_.size() < wanted_) return true;
    if (!in_body_) {
      if (!header_done()) return false;
      in_body_ = true;
    } else {
      if (kept_.empty() || body_done()) on_message(message_);
      in_body_ = false;
      wanted_ = sizeof(igtl_header);
    }
    kept_.clear();
  }
}

}  // namespace palpate
