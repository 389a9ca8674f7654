#include "palpate/session/yaml_edit.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "palpate/core/errors.h"
#include "palpate/core/yaml_tree.h"
#include "palpate/session/yaml_spans.h"

namespace palpate {

namespace {

YAML::Node load(const std::string& text, const std::string& what) {
  try {
    YAML::Node node = YAML::Load(text);
    require_tree(node);
    return node;
  } catch (const YAML::Exception& error) {
    throw BadInput(fmt::format("{} is not valid YAML: {}", what, error.msg));
  }
}

bool same(const YAML::Node& a, const YAML::Node& b) {
  if (a.Type() != b.Type() || a.size() != b.size()) return false;
  if (a.IsScalar()) return a.Scalar() == b.Scalar();
  if (a.IsSequence()) {
    for (size_t i = 0; i < a.size(); ++i)
      if (!same(a[i], b[i])) return false;
    return true;
  }
  if (a.IsMap())
    return std::all_of(a.begin(), a.end(), [&b](const auto& pair) {
      const YAML::Node other = b[pair.first.Scalar()];
      return other && same(pair.second, other);
    });
  return true;
}

/// Number of an item of a list; nothing for "+" and for what the list does not hold.
std::optional<size_t> item_number(const YAML::Node& list, const std::string& name) {
  size_t number = 0;
  const auto [last, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc() || last != name.data() + name.size() || number >= list.size()) return std::nullopt;
  return number;
}

/// What the tree has to be after the change.
YAML::Node expected_tree(const YAML::Node& node, const std::vector<std::string>& path, size_t depth,
                         const YAML::Node& value) {
  if (depth == path.size()) return value;
  const std::string& name = path[depth];
  const bool removes = depth + 1 == path.size() && !value.IsDefined();
  const bool begins_list = name == "+" && (node.IsNull() || (node.IsMap() && node.size() == 0));
  if (node.IsSequence() || begins_list) {
    YAML::Node list(YAML::NodeType::Sequence);
    const std::optional<size_t> number = item_number(node, name);
    for (size_t i = 0; i < (begins_list ? 0 : node.size()); ++i)
      if (number != i)
        list.push_back(node[i]);
      else if (!removes)
        list.push_back(expected_tree(node[i], path, depth + 1, value));
    if (!number) list.push_back(expected_tree(YAML::Node(YAML::NodeType::Map), path, depth + 1, value));
    return list;
  }
  YAML::Node map(YAML::NodeType::Map);
  bool found = false;
  if (node.IsMap())
    for (const auto& pair : node) {
      const bool is_this = pair.first.Scalar() == name;
      found |= is_this;
      if (!is_this)
        map[pair.first] = pair.second;
      else if (!removes)
        map[pair.first] = expected_tree(pair.second, path, depth + 1, value);
    }
  if (!found && !removes) map[name] = expected_tree(YAML::Node(YAML::NodeType::Map), path, depth + 1, value);
  return map;
}

size_t offset_of(const YAML::Node& node) {
  return static_cast<size_t>(std::max(0, node.Mark().pos));
}

bool is_in_brackets(const std::string& text, const YAML::Node& node) {
  const size_t at = offset_of(node);
  return at < text.size() && (text[at] == '{' || text[at] == '[');
}

/// A key with its value, or an item of a list.
struct Place {
  TextSpan whole;  ///< from the key, or from the dash
  TextSpan value;
};

Place place_of_value(const std::string& text, const YAML::Node& parent, const YAML::Node& key,
                     const YAML::Node& value) {
  const bool brackets = is_in_brackets(text, parent);
  if (parent.IsSequence()) {
    const size_t item = offset_of(value);
    if (brackets) {
      const TextSpan span = value_in_brackets(text, item);
      return {span, span};
    }
    const size_t dash = text.rfind('-', item == 0 ? 0 : item - 1);
    if (dash == std::string::npos) return {};
    const TextSpan span = value_in_lines(text, dash + 1, dash - line_begin(text, dash), true);
    return {{dash, span.end}, span};
  }
  const size_t begin = offset_of(key), colon = behind_colon(text, begin);
  const TextSpan span =
      brackets ? value_in_brackets(text, colon) : value_in_lines(text, colon, begin - line_begin(text, begin), false);
  return {{begin, span.end}, span};
}

std::string replaced(const std::string& text, TextSpan span, const std::string& by) {
  return text.substr(0, span.begin) + by + text.substr(span.end);
}

/// "b: {c: value}" for what is left of a path.
std::string nested(const std::vector<std::string>& path, size_t depth, const std::string& value) {
  std::string text = value;
  for (size_t i = path.size(); i > depth + 1; --i)
    text = path[i - 1] == "+" ? fmt::format("[{}]", text) : fmt::format("{{{}: {}}}", path[i - 1], text);
  return text;
}

std::string inserted(const std::string& text, const YAML::Node& parent, const std::string& name,
                     const std::string& value) {
  const std::string entry = parent.IsSequence() ? value : name + ": " + value;
  if (is_in_brackets(text, parent)) {
    const size_t open = offset_of(parent), at = end_of_content(text, open);
    return replaced(text, {at, at}, (at == open + 1 ? "" : ", ") + entry);
  }
  const size_t begin = offset_of(parent);
  const std::string indent(begin - line_begin(text, begin), ' ');
  size_t last = begin;
  if (parent.IsSequence()) {
    last = place_of_value(text, parent, {}, parent[parent.size() - 1]).whole.end;
    const size_t dash = text.rfind('-', last);
    if (dash == std::string::npos) return text;
  } else {
    for (const auto& pair : parent)
      last = std::max(last, place_of_value(text, parent, pair.first, pair.second).whole.end);
  }
  const size_t end = line_end(text, last);
  return replaced(text, {end, end}, "\n" + indent + (parent.IsSequence() ? "- " : "") + entry);
}

std::string without(const std::string& text, const YAML::Node& parent, const Place& place) {
  TextSpan span = place.whole;
  if (is_in_brackets(text, parent)) {
    const size_t comma = text.find_first_not_of(" \t\r\n", span.end);
    if (comma != std::string::npos && text[comma] == ',') {
      span.end = std::min(text.find_first_not_of(" \t", comma + 1), text.size());
    } else {
      const size_t before = text.find_last_not_of(" \t\r\n", span.begin - 1);
      if (before != std::string::npos && text[before] == ',') span.begin = before;
    }
    return replaced(text, span, "");
  }
  return replaced(text, {line_begin(text, span.begin), std::min(line_end(text, span.end) + 1, text.size())}, "");
}

std::string edited(const std::string& text, const YamlChange& change) {
  YAML::Node node = load(text, "the scene file");
  const bool removes = change.value.empty();
  if (node.IsNull()) {
    if (removes) return text;
    return fmt::format("{}{}{}: {}\n", text, text.empty() || text.back() == '\n' ? "" : "\n", change.path[0],
                       nested(change.path, 0, change.value));
  }
  for (size_t depth = 0; depth < change.path.size(); ++depth) {
    const std::string& name = change.path[depth];
    YAML::Node key, value(YAML::NodeType::Undefined);
    if (node.IsMap())
      for (const auto& pair : node)
        if (pair.first.Scalar() == name) {
          key.reset(pair.first);
          value.reset(pair.second);
        }
    if (node.IsSequence())
      if (const std::optional<size_t> number = item_number(node, name)) value.reset(node[*number]);
    if (!value.IsDefined())
      return removes ? text : inserted(text, node, name, nested(change.path, depth, change.value));
    const Place place = place_of_value(text, node, key, value);
    const bool is_last = depth + 1 == change.path.size();
    if (is_last && removes) {
      if (node.size() > 1 || depth == 0 || is_in_brackets(text, node)) return without(text, node, place);
      std::vector<std::string> group = change.path;
      group.pop_back();
      return edited(text, {group, node.IsSequence() ? "[]" : "{}"});
    }
    const bool is_behind_key = place.value.begin > 0 && text[place.value.begin - 1] == ':';
    const auto put = [&](const std::string& now) {
      return replaced(text, place.value, (is_behind_key ? " " : "") + now);
    };
    if (is_last) return put(change.value);
    const bool is_empty = value.IsNull() || ((value.IsMap() || value.IsSequence()) && value.size() == 0);
    if (is_empty && removes) return text;
    if (is_empty) {
      const std::string inner = nested(change.path, depth + 1, change.value);
      return put(change.path[depth + 1] == "+" ? "[" + inner + "]"
                                               : fmt::format("{{{}: {}}}", change.path[depth + 1], inner));
    }
    node.reset(value);
  }
  return text;
}

}  // namespace

std::string with_changes(const std::string& text, const std::vector<YamlChange>& changes) {
  std::string now = text;
  for (const YamlChange& change : changes) {
    const std::string name = fmt::format("{}", fmt::join(change.path, "."));
    if (change.path.empty()) throw BadInput("a change names no key");
    YAML::Node value(YAML::NodeType::Undefined);
    if (!change.value.empty()) value = load(change.value, name);
    const YAML::Node before = load(now, "the scene file");
    const std::string next = edited(now, change);
    const auto refuse = [&] {
      throw BadInput(fmt::format("{} cannot be changed where it is written; change it in the file itself", name));
    };
    try {
      const YAML::Node after = YAML::Load(next);
      const bool is_change = !change.value.empty() || next != now;
      if (is_change && !same(after, expected_tree(before, change.path, 0, value))) refuse();
    } catch (const YAML::Exception&) {
      refuse();
    }
    now = next;
  }
  return now;
}

}  // namespace palpate
