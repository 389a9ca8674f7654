#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "palpate/core/errors.h"

namespace palpate {

/// Words and binary numbers out of a mesh file that is held in memory. Every step beyond the end throws BadInput.
class MeshBytes {
 public:
  explicit MeshBytes(std::string_view bytes) : bytes_(bytes) {}

  bool at_end() const { return at_ >= bytes_.size(); }
  size_t left() const { return bytes_.size() - at_; }

  /// Up to the next line end, without it.
  std::string_view line() {
    const size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    std::string_view text = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
  }

  /// The next word between blanks; empty at the end.
  std::string_view word() {
    constexpr std::string_view kBlanks = " \t\r\n\f\v";
    const size_t begin = std::min(bytes_.find_first_not_of(kBlanks, at_), bytes_.size());
    at_ = std::min(bytes_.find_first_of(kBlanks, begin), bytes_.size());
    return bytes_.substr(begin, at_ - begin);
  }

  std::string_view take(size_t count) {
    if (count > left()) throw BadInput("the file is cut short");
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }

  template <class Number>
  Number binary(bool swapped) {
    char raw[sizeof(Number)];
    std::memcpy(raw, take(sizeof raw).data(), sizeof raw);
    if (swapped) std::reverse(raw, raw + sizeof raw);
    Number value;
    std::memcpy(&value, raw, sizeof value);
    return value;
  }

  size_t place() const { return at_; }
  void go_to(size_t place) { at_ = std::min(place, bytes_.size()); }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
};

}  // namespace palpate
