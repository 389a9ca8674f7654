#include "palpate/session/yaml_spans.h"

#include <algorithm>

namespace palpate {

namespace {

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool begins_comment(const std::string& text, size_t at) {
  return text[at] == '#' && (at == 0 || is_space(text[at - 1]));
}

/// Behind the quoted text that begins at `at`.
size_t end_of_quotes(const std::string& text, size_t at) {
  const char quote = text[at++];
  for (; at < text.size(); ++at) {
    if (text[at] == '\\' && quote == '"') {
      ++at;
    } else if (text[at] == quote) {
      if (quote == '\'' && at + 1 < text.size() && text[at + 1] == quote)
        ++at;
      else
        return at + 1;
    }
  }
  return text.size();
}

bool may_begin_quotes(const std::string& text, size_t at) {
  if (text[at] != '"' && text[at] != '\'') return false;
  size_t before = at;
  while (before > 0 && (text[before - 1] == ' ' || text[before - 1] == '\t')) --before;
  return before == 0 || before < at || std::string(",:[{\n").find(text[before - 1]) != std::string::npos;
}

/// Walks over brackets from `at`, which is behind `depth` open ones; ends at the first place where `ends(at, depth)`.
template <class Ends>
size_t walk(const std::string& text, size_t at, int depth, size_t& last_content, const Ends& ends) {
  while (at < text.size()) {
    if (ends(at, depth)) return at;
    const char c = text[at];
    if (begins_comment(text, at)) {
      at = line_end(text, at);
      continue;
    }
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    const size_t next = may_begin_quotes(text, at) ? end_of_quotes(text, at) : at + 1;
    if (!is_space(c)) last_content = next;
    at = next;
  }
  return at;
}

/// Behind the last of the lines that follow `at` and belong to a value that begins deeper than `indent`.
size_t end_of_deeper_lines(const std::string& text, size_t at, size_t indent, bool also_items) {
  size_t last = line_end(text, at);
  for (size_t begin = last + 1; begin < text.size(); begin = line_end(text, begin) + 1) {
    const size_t end = line_end(text, begin);
    const size_t content = std::min(text.find_first_not_of(" \t\r", begin), end);
    if (content == end || text[content] == '#') continue;
    const bool is_item = text[content] == '-' && (content + 1 >= end || text[content + 1] == ' ');
    if (content - begin > indent || (also_items && content - begin == indent && is_item))
      last = end;
    else
      break;
  }
  return last;
}

}  // namespace

size_t line_begin(const std::string& text, size_t at) {
  const size_t newline = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  return newline == std::string::npos ? 0 : newline + 1;
}

size_t line_end(const std::string& text, size_t at) {
  return std::min(text.find('\n', at), text.size());
}

size_t indent_of_line(const std::string& text, size_t at) {
  const size_t begin = line_begin(text, at);
  return std::min(text.find_first_not_of(' ', begin), text.size()) - begin;
}

size_t end_of_brackets(const std::string& text, size_t open) {
  size_t last = open;
  return std::min(walk(text, open + 1, 1, last,
                       [&](size_t at, int depth) { return depth == 1 && (text[at] == ']' || text[at] == '}'); }) +
                      1,
                  text.size());
}

size_t end_of_content(const std::string& text, size_t open) {
  size_t last = open + 1;
  walk(text, open + 1, 1, last,
       [&](size_t at, int depth) { return depth == 1 && (text[at] == ']' || text[at] == '}'); });
  return last;
}

size_t behind_colon(const std::string& text, size_t key) {
  size_t at = key < text.size() && (text[key] == '"' || text[key] == '\'') ? end_of_quotes(text, key) : key;
  at = text.find(':', at);
  return at == std::string::npos ? text.size() : at + 1;
}

TextSpan value_in_brackets(const std::string& text, size_t from) {
  size_t last = from;
  walk(text, from, 0, last,
       [&](size_t at, int depth) { return depth == 0 && (text[at] == ',' || text[at] == ']' || text[at] == '}'); });
  size_t begin = from;
  while (begin < last && is_space(text[begin])) ++begin;
  return {begin, std::max(begin, last)};
}

TextSpan value_in_lines(const std::string& text, size_t from, size_t indent, bool is_behind_dash) {
  const size_t end = line_end(text, from);
  const size_t begin = std::min(text.find_first_not_of(" \t\r", from), end);
  if (begin == end || begins_comment(text, begin)) {
    const size_t last = end_of_deeper_lines(text, from, indent, !is_behind_dash);
    if (last == end) return {from, from};
    // From the colon on, so that a value of one line can follow it.
    return {from, last};
  }
  const char c = text[begin];
  if (c == '[' || c == '{') return {begin, end_of_brackets(text, begin)};
  if (c == '|' || c == '>') return {begin, end_of_deeper_lines(text, from, indent, false)};
  if (c == '"' || c == '\'') {
    const size_t quoted = end_of_quotes(text, begin);
    if (!is_behind_dash || text.compare(quoted, 1, ":") != 0) return {begin, quoted};
  }
  size_t last = begin;
  walk(text, begin, 0, last, [&](size_t at, int) { return at >= end; });
  // "- key: value" goes on in the lines below.
  const std::string line = text.substr(begin, last - begin);
  const bool is_map = is_behind_dash && (line.find(": ") != std::string::npos || line.ends_with(':'));
  return {begin, is_map ? std::max(last, end_of_deeper_lines(text, from, indent, false)) : last};
}

}  // namespace palpate
