#include "palpate/core/settings.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "palpate/core/errors.h"
#include "palpate/core/settings_file.h"
#include "palpate/core/source_kind.h"
#include "palpate/core/table_text.h"
#include "palpate/core/whole_file.h"
#include "palpate/core/yaml_tree.h"

namespace palpate {

namespace {

std::string shortest(double value) {
  return fmt::format("{}", value);
}

constexpr size_t kMaxShown = 60;

/// What a file says, fit for a sentence: on one line and not too long.
std::string shown(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = ' ';
  if (text.size() <= kMaxShown) return text;
  size_t end = kMaxShown;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;  // whole UTF-8 characters
  return text.substr(0, end) + "...";
}

/// "scene.yaml:12"
std::string place_of(const YAML::Node& node, const SettingsContext& context) {
  const YAML::Mark mark = node.Mark();
  const std::string file = context.file.string();
  return mark.is_null() ? file : fmt::format("{}:{}", file, mark.line + 1);
}

/// "scene.yaml:12: map.thickness_mm"
std::string place_of(const YAML::Node& node, const SettingsContext& context, const std::string& key) {
  return fmt::format("{}: {}", place_of(node, context), shown(key));
}

std::string written(const YAML::Node& node) {
  if (!node || node.IsNull()) return "nothing";
  if (node.IsScalar()) return "'" + shown(node.Scalar()) + "'";
  return node.IsMap() ? "a group of keys" : "a list";
}

double number_of(const YAML::Node& node, const std::string& place, const Range& range) {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value))
    throw BadInput(fmt::format("{} is {}, expected a number {}", place, written(node), range.text()));
  if (!range.contains(value))
    throw BadInput(fmt::format("{} is {}, expected {}", place, shortest(value), range.text()));
  return value;
}

std::vector<double> numbers_of(const YAML::Node& node, size_t count, const std::string& place, const Range& range) {
  if (!node.IsSequence() || node.size() != count)
    throw BadInput(fmt::format("{} is {}, expected a list of {} numbers", place, written(node), count));
  std::vector<double> values;
  for (const YAML::Node& item : node) values.push_back(number_of(item, place, range));
  return values;
}

std::string flow(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (double value : values) texts.push_back(shortest(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string flow(const std::vector<cv::Point2d>& points) {
  std::vector<std::string> texts;
  for (const cv::Point2d& point : points) texts.push_back(flow(std::vector<double>{point.x, point.y}));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string indented(const std::string& text, const std::string& first, const std::string& rest) {
  std::string result = first;
  for (size_t i = 0; i < text.size(); ++i) {
    result += text[i];
    if (text[i] == '\n' && i + 1 < text.size()) result += rest;
  }
  return result;
}

bool is_plain_yaml_text(const std::string& text) {
  return !text.empty() &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./") ==
             std::string::npos;
}

/// Tabs, newlines and everything above are text; other control characters are not.
bool is_text(const std::string& content) {
  return std::all_of(content.begin(), content.end(), [](char c) {
    return static_cast<unsigned char>(c) >= ' ' || c == '\n' || c == '\r' || c == '\t';
  });
}

std::string yaml_text(const std::string& text) {
  if (is_plain_yaml_text(text)) return text;
  std::string escaped = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') escaped += '\\';
    escaped += c;
  }
  return escaped + "\"";
}

}  // namespace

bool Range::contains(double value) const {
  return (open_min ? value > min : value >= min) && (open_max ? value < max : value <= max);
}

std::string Range::text() const {
  const bool lower = std::isfinite(min), upper = std::isfinite(max);
  if (!lower && !upper) return "any";
  std::string text = lower ? fmt::format("{} {} ", shortest(min), open_min ? "<" : "<=") : "";
  text += "x";
  if (upper) text += fmt::format(" {} {}", open_max ? "<" : "<=", shortest(max));
  return text;
}

/// One key: how to read it, write it and describe it.
struct Settings::Entry {
  std::string key;
  std::string doc;
  std::string range;
  bool required = false;
  std::function<void(const YAML::Node&, const SettingsContext&, const std::string& place, const std::string& prefix)>
      read;
  std::function<std::string()> write;  ///< value as YAML: one line, or a block that starts with a newline
  std::function<std::string(const std::string& prefix)> document_nested;  ///< rows of a nested group
  std::string default_text;
};

Settings::Settings() = default;
Settings::~Settings() = default;
Settings::Settings(Settings&&) noexcept = default;
Settings& Settings::operator=(Settings&&) noexcept = default;

void Settings::number(const std::string& key, double& field, Range range, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = range.text();
  entry->read = [&field, range](const YAML::Node& node, const SettingsContext&, const std::string& place,
                                const std::string&) { field = number_of(node, place, range); };
  entry->write = [&field] { return shortest(field); };
  entry->default_text = shortest(field);
  entries_.push_back(std::move(entry));
}

void Settings::number_or_word(const std::string& key, double& field, Range range, const std::string& word,
                              bool& is_word, const std::string& doc) {
  number(key, field, range, doc);
  Entry& entry = *entries_.back();
  entry.range = fmt::format("{}, or {}", range.text(), word);
  entry.read = [&field, &is_word, range, word](const YAML::Node& node, const SettingsContext&, const std::string& place,
                                               const std::string&) {
    double value = 0;
    is_word = node.IsScalar() && node.Scalar() == word;
    if (is_word) return;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value))
      throw BadInput(fmt::format("{} is {}, expected a number {}, or {}", place, written(node), range.text(), word));
    field = number_of(node, place, range);
  };
  entry.write = [&field, &is_word, word] { return is_word ? word : shortest(field); };
}

void Settings::integer(const std::string& key, int& field, Range range, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = range.text();
  entry->read = [&field, range](const YAML::Node& node, const SettingsContext&, const std::string& place,
                                const std::string&) {
    const double value = number_of(node, place, range);
    if (value != std::floor(value) || std::abs(value) > 2e9)
      throw BadInput(fmt::format("{} is {}, expected a whole number", place, shortest(value)));
    field = static_cast<int>(value);
  };
  entry->write = [&field] { return std::to_string(field); };
  entry->default_text = std::to_string(field);
  entries_.push_back(std::move(entry));
}

void Settings::flag(const std::string& key, bool& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "true or false";
  entry->read = [&field](const YAML::Node& node, const SettingsContext&, const std::string& place, const std::string&) {
    if (!node.IsScalar() || !YAML::convert<bool>::decode(node, field))
      throw BadInput(fmt::format("{} is {}, expected true or false", place, written(node)));
  };
  entry->write = [&field] { return field ? "true" : "false"; };
  entry->default_text = field ? "true" : "false";
  entries_.push_back(std::move(entry));
}

void Settings::text(const std::string& key, std::string& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->read = [&field](const YAML::Node& node, const SettingsContext&, const std::string& place, const std::string&) {
    if (!node.IsScalar()) throw BadInput(fmt::format("{} is {}, expected a text", place, written(node)));
    field = node.Scalar();
  };
  entry->write = [&field] { return field.empty() ? std::string() : yaml_text(field); };
  entry->default_text = field;
  entries_.push_back(std::move(entry));
}

namespace {

std::string expanded_at(const std::string& place, const YAML::Node& node) {
  try {
    return expand_environment(node.Scalar());
  } catch (const BadInput& error) {
    throw BadInput(fmt::format("{}: {}", place, error.what()));
  }
}

}  // namespace

void Settings::path(const std::string& key, std::filesystem::path& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "path";
  entry->read = [&field](const YAML::Node& node, const SettingsContext& context, const std::string& place,
                         const std::string&) {
    if (!node.IsScalar() || node.Scalar().empty())
      throw BadInput(fmt::format("{} is {}, expected a path", place, written(node)));
    const std::string expanded = expanded_at(place, node);
    const bool is_file = kind_of_source(expanded) == SourceKind::file;
    field = is_file ? (context.folder / expanded).lexically_normal() : std::filesystem::path(expanded);
  };
  entry->write = [&field] { return field.empty() ? std::string() : yaml_text(field.string()); };
  entry->default_text = field.string();
  entries_.push_back(std::move(entry));
}

void Settings::vector3(const std::string& key, Eigen::Vector3d& field, Range range, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "[x, y, z]" + (range.text() == "any" ? "" : ", " + range.text());
  entry->read = [&field, range](const YAML::Node& node, const SettingsContext&, const std::string& place,
                                const std::string&) {
    const std::vector<double> values = numbers_of(node, 3, place, range);
    field = {values[0], values[1], values[2]};
  };
  entry->write = [&field] { return flow(std::vector<double>{field[0], field[1], field[2]}); };
  entry->default_text = entry->write();
  entries_.push_back(std::move(entry));
}

void Settings::matrix3(const std::string& key, Eigen::Matrix3d& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "[[..], [..], [..]]";
  entry->read = [&field](const YAML::Node& node, const SettingsContext&, const std::string& place, const std::string&) {
    if (!node.IsSequence() || node.size() != 3)
      throw BadInput(fmt::format("{} is {}, expected three rows of three numbers", place, written(node)));
    for (int row = 0; row < 3; ++row) {
      const std::vector<double> values = numbers_of(node[static_cast<size_t>(row)], 3, place, {});
      field.row(row) << values[0], values[1], values[2];
    }
  };
  entry->write = [&field] {
    std::vector<std::string> rows;
    for (int row = 0; row < 3; ++row)
      rows.push_back(flow(std::vector<double>{field(row, 0), field(row, 1), field(row, 2)}));
    return fmt::format("[{}]", fmt::join(rows, ", "));
  };
  entry->default_text = entry->write();
  entries_.push_back(std::move(entry));
}

void Settings::pixel(const std::string& key, cv::Point2d& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "[x, y]";
  entry->read = [&field](const YAML::Node& node, const SettingsContext&, const std::string& place, const std::string&) {
    const std::vector<double> values = numbers_of(node, 2, place, {});
    field = {values[0], values[1]};
  };
  entry->write = [&field] { return flow(std::vector<double>{field.x, field.y}); };
  entry->default_text = entry->write();
  entries_.push_back(std::move(entry));
}

void Settings::rectangle(const std::string& key, cv::Rect2d& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "[x, y, width, height]";
  entry->read = [&field](const YAML::Node& node, const SettingsContext&, const std::string& place, const std::string&) {
    const std::vector<double> values = numbers_of(node, 4, place, {0, 1e5});
    field = {values[0], values[1], values[2], values[3]};
  };
  entry->write = [&field] { return flow(std::vector<double>{field.x, field.y, field.width, field.height}); };
  entry->default_text = entry->write();
  entries_.push_back(std::move(entry));
}

void Settings::points(const std::string& key, std::vector<cv::Point2d>& field, const std::string& doc) {
  polygon(key, field, doc);
  Entry& entry = *entries_.back();
  entry.range = "[x, y] or [[x, y], ...]";
  entry.read = [&field, of_polygon = entry.read](const YAML::Node& node, const SettingsContext& context,
                                                 const std::string& place, const std::string& prefix) {
    if (!node.IsSequence() || node.size() != 2 || !node[0].IsScalar()) return of_polygon(node, context, place, prefix);
    const std::vector<double> values = numbers_of(node, 2, place, {});
    field = {{values[0], values[1]}};
  };
  entry.write = [&field] {
    if (field.size() != 1) return field.empty() ? std::string() : flow(field);
    return flow(std::vector<double>{field[0].x, field[0].y});
  };
}

void Settings::polygon(const std::string& key, std::vector<cv::Point2d>& field, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "[[x, y], ...]";
  entry->read = [&field](const YAML::Node& node, const SettingsContext&, const std::string& place, const std::string&) {
    if (!node.IsSequence() || node.size() < 3)
      throw BadInput(fmt::format("{} is {}, expected at least three corners [[x, y], ...]", place, written(node)));
    field.clear();
    for (const YAML::Node& corner : node) {
      const std::vector<double> values = numbers_of(corner, 2, place, {});
      field.emplace_back(values[0], values[1]);
    }
  };
  entry->write = [&field] { return field.empty() ? std::string() : flow(field); };
  entries_.push_back(std::move(entry));
}

void Settings::choice_by_index(const std::string& key, const std::vector<std::string>& names,
                               const std::function<int()>& get, const std::function<void(int)>& set,
                               const std::string& doc, const std::string& extension, std::filesystem::path* file) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = fmt::format("{}{}", fmt::join(names, ", "), file ? ", or a file *" + extension : "");
  entry->read = [names, set, extension, file](const YAML::Node& node, const SettingsContext& context,
                                              const std::string& place, const std::string&) {
    const std::string word = node.IsScalar() ? node.Scalar() : "";
    if (file && word.ends_with(extension)) {
      *file = (context.folder / expanded_at(place, node)).lexically_normal();
      set(static_cast<int>(names.size()));
      return;
    }
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) {
      const std::string nearest = nearest_word(word, names);
      throw BadInput(fmt::format("{} is {}, expected one of: {}{}{}", place, written(node), fmt::join(names, ", "),
                                 file ? ", or a file *" + extension : "",
                                 nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
    }
    set(static_cast<int>(found - names.begin()));
  };
  entry->write = [names, get, file] {
    const auto index = static_cast<size_t>(get());
    return index < names.size() ? names[index] : yaml_text(file->string());
  };
  entry->default_text = entry->write();
  entries_.push_back(std::move(entry));
}

void Settings::choices_by_index(const std::string& key, const std::vector<std::string>& names,
                                const std::function<std::vector<int>()>& get,
                                const std::function<void(const std::vector<int>&)>& set, const std::string& doc) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = fmt::format("[] of: {}", fmt::join(names, ", "));
  entry->read = [names, set](const YAML::Node& node, const SettingsContext&, const std::string& place,
                             const std::string&) {
    if (!node.IsSequence())
      throw BadInput(
          fmt::format("{} is {}, expected a list [..] of: {}", place, written(node), fmt::join(names, ", ")));
    std::vector<int> indices;
    for (const YAML::Node& item : node) {
      const auto found = std::find(names.begin(), names.end(), item.IsScalar() ? item.Scalar() : "");
      if (found == names.end())
        throw BadInput(fmt::format("{} holds {}, expected some of: {}", place, written(item), fmt::join(names, ", ")));
      indices.push_back(static_cast<int>(found - names.begin()));
    }
    set(indices);
  };
  entry->write = [names, get] {
    std::vector<std::string> words;
    for (int index : get()) words.push_back(names[static_cast<size_t>(index)]);
    return fmt::format("[{}]", fmt::join(words, ", "));
  };
  entry->default_text = entry->write();
  entries_.push_back(std::move(entry));
}

void Settings::group(const std::string& key, const std::string& doc,
                     const std::function<void(Settings&)>& describe_group, bool* present) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "group";
  entry->read = [describe_group, present](const YAML::Node& node, const SettingsContext& context, const std::string&,
                                          const std::string& prefix) {
    if (present) *present = true;
    Settings nested;
    describe_group(nested);
    read_settings(node, context, nested, prefix + ".");
  };
  entry->write = [describe_group, present]() -> std::string {
    if (present && !*present) return {};
    Settings nested;
    describe_group(nested);
    const std::string text = write_settings(nested);
    return text.empty() ? " {}" : "\n" + indented(text, "  ", "  ");
  };
  entry->document_nested = [describe_group](const std::string& prefix) {
    Settings nested;
    describe_group(nested);
    return document_settings(nested, prefix + ".");
  };
  entries_.push_back(std::move(entry));
}

void Settings::list(const std::string& key, const std::string& doc, const std::function<int()>& count,
                    const std::function<void(int)>& resize, const std::function<void(Settings&, int)>& describe_item) {
  auto entry = std::make_unique<Entry>();
  entry->key = key;
  entry->doc = doc;
  entry->range = "list";
  entry->read = [resize, describe_item](const YAML::Node& node, const SettingsContext& context,
                                        const std::string& place, const std::string& prefix) {
    if (!node.IsSequence()) throw BadInput(fmt::format("{} is {}, expected a list", place, written(node)));
    resize(static_cast<int>(node.size()));
    for (size_t i = 0; i < node.size(); ++i) {
      Settings item;
      describe_item(item, static_cast<int>(i));
      read_settings(node[i], context, item, fmt::format("{}[{}].", prefix, i));
    }
  };
  entry->write = [count, describe_item]() -> std::string {
    std::string text;
    for (int i = 0; i < count(); ++i) {
      Settings item;
      describe_item(item, i);
      text += "\n" + indented(write_settings(item), "  - ", "    ");
      if (!text.empty() && text.back() == '\n') text.pop_back();
    }
    return text.empty() ? " []" : text + "\n";
  };
  entry->document_nested = [count, resize, describe_item](const std::string& prefix) {
    const int before = count();
    resize(1);
    Settings item;
    describe_item(item, 0);
    std::string text = document_settings(item, prefix + "[].");
    resize(before);
    return text;
  };
  entries_.push_back(std::move(entry));
}

void Settings::not_yet(const std::vector<std::string>& keys) {
  not_yet_.insert(not_yet_.end(), keys.begin(), keys.end());
}

void Settings::require(const std::string& key) {
  for (auto& entry : entries_)
    if (entry->key == key) entry->required = true;
}

void Settings::after_reading(const std::function<void()>& check) {
  checks_.push_back(check);
}

void read_settings(const YAML::Node& node, const SettingsContext& context, Settings& settings,
                   const std::string& prefix) {
  const std::string group_name = prefix.empty() ? "the file" : prefix.substr(0, prefix.size() - 1);
  const auto refuse_not_yet = [&](const YAML::Node& at, const std::string& key, const std::string& name) {
    if (std::find(settings.not_yet_.begin(), settings.not_yet_.end(), key) != settings.not_yet_.end())
      throw BadInput(fmt::format("{} is not available yet in this version", place_of(at, context, name)));
  };
  if (node.IsSequence() && node.size() > 1) refuse_not_yet(node[1], "[1]", group_name + "[1]");
  if (!node.IsMap() && !node.IsNull())
    throw BadInput(
        fmt::format("{} is {}, expected a group of keys", place_of(node, context, group_name), written(node)));
  std::vector<std::string> names;
  for (const auto& entry : settings.entries_) names.push_back(entry->key);
  std::vector<std::string> seen;
  for (const auto& pair : node) {
    const std::string key = pair.first.IsScalar() ? pair.first.Scalar() : "?";
    const std::string place = place_of(pair.first, context, prefix + key);
    const auto found = std::find(names.begin(), names.end(), key);
    if (found == names.end()) {
      refuse_not_yet(pair.first, key, prefix + key);
      const std::string nearest = nearest_word(key, names);
      throw BadInput(nearest.empty() ? fmt::format("{} is not a known key; known in {}: {}", place, group_name,
                                                   fmt::join(names, ", "))
                                     : fmt::format("{} is not a known key; did you mean '{}'?", place, nearest));
    }
    if (std::find(seen.begin(), seen.end(), key) != seen.end())
      throw BadInput(fmt::format("{} stands there twice, expected once", place));
    seen.push_back(key);
    settings.entries_[static_cast<size_t>(found - names.begin())]->read(pair.second, context, place, prefix + key);
  }
  for (const auto& entry : settings.entries_)
    if (entry->required && std::find(seen.begin(), seen.end(), entry->key) == seen.end())
      throw BadInput(fmt::format("{}: {}{} is missing ({})", place_of(node, context), prefix, entry->key, entry->doc));
  for (const auto& check : settings.checks_) {
    try {
      check();
    } catch (const BadInput& error) {
      const bool names_group = std::string(error.what()).starts_with(group_name);
      throw BadInput(fmt::format("{}: {}", names_group ? place_of(node, context) : place_of(node, context, group_name),
                                 error.what()));
    }
  }
}

YAML::Node load_settings_file(const std::filesystem::path& file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a YAML scene file", file.string(), obstacle));
  std::string content = read_whole_file(file);
  if (has_byte_order_mark(content)) content = as_utf8(content);
  if (!is_text(content)) throw BadInput(fmt::format("{} is no text, expected a YAML scene file", file.string()));
  try {
    const std::vector<YAML::Node> documents = load_documents(content);
    for (size_t i = 1; i < documents.size(); ++i)
      if (!documents[i].IsNull())
        throw BadInput(fmt::format("{}: a second document begins here, after ---; expected one in a file",
                                   place_of(documents[i], {file, {}})));
    if (documents.empty()) return {};
    require_closed_quotes(content, documents.front());
    return documents.front();
  } catch (const YAML::Exception& error) {
    throw BadInput(fmt::format("{}:{}: not valid YAML: {}", file.string(), error.mark.line + 1, shown(error.msg)));
  }
}

void read_settings_file(const std::filesystem::path& file, Settings& settings) {
  const YAML::Node root = load_settings_file(file);
  read_settings(root, {file, std::filesystem::absolute(file).parent_path()}, settings);
}

std::string write_settings(const Settings& settings) {
  std::string text;
  for (const auto& entry : settings.entries_) {
    const std::string value = entry->write();
    if (value.empty()) continue;
    const bool block = value.front() == '\n' || value.front() == ' ';
    text += entry->key + ":" + (block ? value : " " + value);
    if (text.back() != '\n') text += "\n";
  }
  return text;
}

std::string document_settings(const Settings& settings, const std::string& prefix) {
  std::string rows;
  if (prefix.empty()) rows = "| key | default | values | meaning |\n|---|---|---|---|\n";
  for (const auto& entry : settings.entries_) {
    rows += fmt::format("| `{}{}` | {} | {} | {} |\n", prefix, entry->key,
                        entry->required               ? "required"
                        : entry->default_text.empty() ? ""
                                                      : "`" + entry->default_text + "`",
                        entry->range, entry->doc);
    if (entry->document_nested) rows += entry->document_nested(prefix + entry->key);
  }
  return rows;
}

}  // namespace palpate
