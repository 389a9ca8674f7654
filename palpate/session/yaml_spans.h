#pragma once

#include <cstddef>
#include <string>

namespace palpate {

/// Half-open part of a text, bytes.
struct TextSpan {
  size_t begin = 0;
  size_t end = 0;
};

/// Where YAML values stand in their text. Offsets are of bytes; what cannot be told ends the value too early, which
/// reading the changed text again finds.
size_t line_begin(const std::string& text, size_t at);
size_t line_end(const std::string& text, size_t at);  ///< of the newline, or of the end of the text
size_t indent_of_line(const std::string& text, size_t at);

/// Just behind the bracket that closes the one at `open`.
size_t end_of_brackets(const std::string& text, size_t open);
/// Behind the last thing between the brackets that is neither space nor comment; `open` + 1 where there is none.
size_t end_of_content(const std::string& text, size_t open);
/// Just behind the colon of the key at `key`.
size_t behind_colon(const std::string& text, size_t key);
/// A value that begins at or behind `from`, in brackets.
TextSpan value_in_brackets(const std::string& text, size_t from);
/// A value behind a key or a dash, in lines; `indent` is that of the key or the dash, and lines of its own begin deeper
/// (list items of a key: as deep). Where there is no value the span is empty.
TextSpan value_in_lines(const std::string& text, size_t from, size_t indent, bool is_behind_dash);

}  // namespace palpate
