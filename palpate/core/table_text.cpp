#include "palpate/core/table_text.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "palpate/core/units.h"

namespace palpate {

namespace {

constexpr const char* kByteOrderMark = "\xEF\xBB\xBF";

void append_utf8(uint32_t code, std::string& text) {
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xC0 | code >> 6);
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else {
    text += static_cast<char>(0xE0 | code >> 12);
    text += static_cast<char>(0x80 | (code >> 6 & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  }
}

std::string from_utf16(const std::string& text, bool big_endian) {
  std::string result;
  for (size_t i = 2; i + 1 < text.size(); i += 2) {
    const auto first = static_cast<uint8_t>(text[i]), second = static_cast<uint8_t>(text[i + 1]);
    append_utf8(big_endian ? static_cast<uint32_t>(first << 8 | second) : static_cast<uint32_t>(second << 8 | first),
                result);
  }
  return result;
}

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

std::string unquoted(std::string_view cell) {
  cell = trimmed(cell);
  if (cell.size() < 2 || cell.front() != '"' || cell.back() != '"') return std::string(cell);
  std::string text;
  cell = cell.substr(1, cell.size() - 2);
  for (size_t i = 0; i < cell.size(); ++i) {
    text += cell[i];
    if (cell[i] == '"' && i + 1 < cell.size() && cell[i + 1] == '"') ++i;
  }
  return std::string(trimmed(text));
}

bool has_byte_order_mark(std::string_view text) {
  return text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF") || text.starts_with(kByteOrderMark);
}

std::string as_utf8(std::string text) {
  if (text.starts_with("\xFF\xFE")) return from_utf16(text, false);
  if (text.starts_with("\xFE\xFF")) return from_utf16(text, true);
  if (text.starts_with(kByteOrderMark)) text.erase(0, 3);
  // A lone micro sign of Latin-1 is the only letter that a unit needs.
  for (size_t at = text.find('\xB5'); at != std::string::npos; at = text.find('\xB5', at + 1))
    if (at == 0 || static_cast<uint8_t>(text[at - 1]) < 0x80) text.replace(at, 1, "u");
  return text;
}

std::string with_plain_minus(std::string text) {
  constexpr const char* kMinus = "\xE2\x88\x92";
  if (text.find(kMinus) == std::string::npos) return text;
  std::string plain;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool is_minus = text.compare(i, 3, kMinus) == 0;
    plain += is_minus ? '-' : text[i];
    i += is_minus ? 2 : 0;
  }
  return plain;
}

bool LineSplitter::next(std::vector<std::string_view>& fields) {
  fields.clear();
  if (at_ >= text_.size()) return false;
  line_ = next_line_;
  const size_t line_begin = at_;
  size_t begin = at_;
  bool quoted = false;
  const auto end_field = [&] {
    // Blanks in a row are one separator, and none at the ends of a line.
    if (separator_ != ' ' || at_ > begin) fields.push_back(text_.substr(begin, at_ - begin));
    begin = at_ + 1;
  };
  for (; at_ < text_.size(); ++at_) {
    const char c = text_[at_];
    if (c == '\n') ++next_line_;
    if (c == '"' && quoted && at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
      ++at_;  // a quote within quotes stands twice
    } else if (c == '"' && (quoted || trimmed(text_.substr(begin, at_ - begin)).empty())) {
      quoted = !quoted;
    } else if (quoted) {
      continue;
    } else if (c == separator_ || (separator_ == ' ' && c == '\t')) {
      end_field();
    } else if (c == '\n' || c == '\r') {
      break;
    }
  }
  end_field();
  whole_ = text_.substr(line_begin, at_ - line_begin);
  if (at_ < text_.size() && text_[at_] == '\r') {
    ++at_;
    if (at_ < text_.size() && text_[at_] != '\n') ++next_line_;  // the line ends of an old Macintosh
    if (at_ < text_.size() && text_[at_] == '\n') ++next_line_, ++at_;
  } else {
    ++at_;
  }
  return true;
}

HeaderCell header_cell(std::string_view cell) {
  std::string text = unquoted(cell);
  while (!text.empty() && (text.front() == '#' || text.front() == '%' || is_space(text.front()))) text.erase(0, 1);
  HeaderCell result;
  for (const auto& [open, close] : {std::pair{'(', ')'}, std::pair{'[', ']'}, std::pair{'{', '}'}}) {
    const size_t begin = text.rfind(open), end = text.rfind(close);
    if (begin == std::string::npos || end == std::string::npos || end < begin || begin == 0) continue;
    result.unit = std::string(trimmed(std::string_view(text).substr(begin + 1, end - begin - 1)));
    text.erase(begin, end - begin + 1);
  }
  text = std::string(trimmed(text));
  if (result.unit.empty()) {
    const size_t cut = text.find_last_of("_ /,");
    if (cut != std::string::npos && cut > 0 && unit_of(text.substr(cut + 1))) {
      result.unit = text.substr(cut + 1);
      text.erase(cut);
      if (text.ends_with(" in")) text.erase(text.size() - 3);
    }
  }
  for (char c : text) {
    if (c == '/') c = '.';
    if (c == '_' || c == '-' || c == ' ' || (c == '.' && result.key.empty())) continue;
    result.key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return result;
}

double number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) return std::strtod(std::string(text).c_str(), nullptr);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace palpate
