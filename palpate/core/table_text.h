#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// The parts of core/table.cpp that know no columns.

/// Without blanks around it, and without the quotes that a spreadsheet puts around it.
std::string_view trimmed(std::string_view text);
std::string unquoted(std::string_view cell);

/// Of UTF-8 or UTF-16.
bool has_byte_order_mark(std::string_view text);

/// As UTF-8 without byte order mark, whichever of UTF-8, UTF-16 and Latin-1 it came in.
std::string as_utf8(std::string text);

/// With "-" for the minus sign of Unicode, which R, matplotlib and word processors write.
std::string with_plain_minus(std::string text);

/// A field that begins with a quote ends with one, and may hold separators and line ends.
class LineSplitter {
 public:
  LineSplitter(std::string_view text, char separator) : text_(text), separator_(separator) {}

  /// The fields of the next line, as they stand in the text; false at the end.
  bool next(std::vector<std::string_view>& fields);

  int line() const { return line_; }  ///< of the fields, from 1
  std::string_view whole() const { return whole_; }

 private:
  std::string_view text_;
  char separator_;
  size_t at_ = 0;
  int line_ = 0, next_line_ = 1;
  std::string_view whole_;
};

/// A header cell taken apart: "Fx (N)" is "fx" and "N", "/wrench/force/x" is "wrench.force.x".
struct HeaderCell {
  std::string key;
  std::string unit;
};
HeaderCell header_cell(std::string_view cell);

/// Whole text as a number with a decimal point; NaN where it is none.
double number_of(std::string_view text);

}  // namespace palpate
