#include "palpate/stereo/calibration_tree.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"

namespace palpate {

namespace {

/// What the formats have in common.
struct Node {
  std::string key;
  std::string text;
  bool is_list = false;
  std::vector<Node> children;

  const Node* child(const std::string& name) const {
    const auto found = std::find_if(children.begin(), children.end(), [&](const Node& c) { return c.key == name; });
    return found == children.end() ? nullptr : &*found;
  }
};

struct Numbers {
  std::vector<double> values;
  int rows = 1;
};

/// Nothing where it is none; ".Nan" and "inf" are numbers that FileStorage writes.
std::optional<double> number_in_calibration(std::string token) {
  std::transform(token.begin(), token.end(), token.begin(), [](unsigned char c) { return std::tolower(c); });
  if (token == ".nan" || token == "nan") return std::nan("");
  if (token == ".inf" || token == "inf") return HUGE_VAL;
  if (token.back() == '.') token += '0';
  const double value = number_of(token);
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

/// "700 0 319.5" and "[700 0 319.5; 0 700 239.5; 0 0 1]"; nothing where there is a word in it.
std::optional<Numbers> numbers_in(const std::string& text) {
  Numbers result;
  std::string token;
  int rows = 1;
  const auto end_token = [&] {
    if (token.empty()) return true;
    const auto value = number_in_calibration(token);
    token.clear();
    result.values.push_back(value.value_or(0));
    result.rows = rows;
    return value.has_value();
  };
  for (const char c : text + " ") {
    if (std::string(" \t\r\n,;[](){}").find(c) == std::string::npos) {
      token += c;
      continue;
    }
    if (!end_token()) return std::nullopt;
    rows += c == ';' && !result.values.empty();
  }
  if (result.values.empty()) return std::nullopt;
  if (result.values.size() % static_cast<size_t>(result.rows) != 0) result.rows = 1;
  return result;
}

Node from_yaml(const YAML::Node& yaml, const std::string& key) {
  Node node{key, "", yaml.IsSequence(), {}};
  if (yaml.IsScalar()) node.text = yaml.Scalar();
  if (yaml.IsSequence())
    for (size_t i = 0; i < yaml.size(); ++i) node.children.push_back(from_yaml(yaml[i], fmt::format("[{}]", i)));
  if (yaml.IsMap())
    for (const auto& child : yaml)
      if (child.first.IsScalar()) node.children.push_back(from_yaml(child.second, child.first.Scalar()));
  return node;
}

/// YAML and JSON. `%YAML:1.0` of FileStorage is no YAML; tabs of JSON are none either.
Node parse_yaml(const std::string& text) {
  std::string plain;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with("%YAML")) plain += line + "\n";
  std::replace(plain.begin(), plain.end(), '\t', ' ');
  Node root;
  for (const YAML::Node& document : YAML::LoadAll(plain))
    if (document.IsMap() || document.IsSequence())
      root.children.push_back(from_yaml(document, fmt::format("[{}]", root.children.size())));
  if (root.children.size() == 1) {
    Node only = std::move(root.children.front());
    only.key.clear();
    return only;
  }
  root.is_list = true;
  return root;
}

Node from_xml(const boost::property_tree::ptree& tree, const std::string& key) {
  Node node{key, tree.data(), false, {}};
  for (const auto& [name, child] : tree) {
    if (name == "<xmlattr>") {
      for (const auto& [attribute, value] : child) node.children.push_back({attribute, value.data(), false, {}});
    } else if (name != "<xmlcomment>") {
      node.children.push_back(from_xml(child, name == "_" ? fmt::format("[{}]", node.children.size()) : name));
    }
  }
  // A value that has attributes is still a value.
  if (!trimmed(node.text).empty() && numbers_in(node.text)) node.children.clear();
  return node;
}

Node parse_xml(const std::string& text) {
  boost::property_tree::ptree tree;
  std::istringstream stream(text);
  boost::property_tree::read_xml(stream, tree);
  Node root = from_xml(tree, "");
  if (root.children.size() == 1 && root.children.front().key == "opencv_storage") {
    Node only = std::move(root.children.front());
    only.key.clear();
    return only;
  }
  return root;
}

/// `[section]`, `key = value`, `key: value`, and rows of numbers below a word that names them, or below none.
Node parse_text(const std::string& text, const std::string& name) {
  Node root;
  const auto add = [&root](const std::string& section, const std::string& key) -> Node& {
    Node* group = &root;
    if (!section.empty()) {
      if (!root.child(section)) root.children.push_back({section, "", false, {}});
      group = const_cast<Node*>(root.child(section));
    }
    group->children.push_back({key, "", false, {}});
    return group->children.back();
  };
  static const std::regex kSection(R"(\[([A-Za-z][^\]=,]*)\])"), kPair(R"(([A-Za-z][\w .\-]*?)\s*[=:]\s*(.*))");
  std::string section, heading = name;
  Node* rows = nullptr;
  size_t row_length = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = std::string(trimmed(line));
    if (line.empty() || line.starts_with("//") || line.starts_with('#') || line.starts_with(';')) continue;
    std::smatch found;
    if (const auto numbers = numbers_in(line)) {
      const bool continues = rows && numbers->values.size() == row_length && row_length > 1;
      if (!continues) rows = &add(section, heading);
      rows->text += (continues ? "; " : "") + line;
      row_length = numbers->values.size();
    } else if (std::regex_match(line, found, kSection)) {
      section = found[1];
      rows = nullptr;
    } else if (std::regex_match(line, found, kPair) && found[2].length() > 0) {
      add(section, found[1]).text = found[2];
      rows = nullptr;
    } else {
      heading = line.substr(0, line.find_last_not_of(":= ") + 1);
      rows = nullptr;
    }
  }
  return root;
}

/// Scalars called R_0, R_1, ... are one value R.
void gather_numbered(Node& node) {
  static const std::regex kNumbered("(.*[A-Za-z])_([0-9]+)");
  std::vector<Node> kept;
  for (Node& child : node.children) {
    std::smatch found;
    const bool is_scalar =
        child.children.empty() && numbers_in(child.text) && numbers_in(child.text)->values.size() == 1;
    if (!is_scalar || !std::regex_match(child.key, found, kNumbered)) {
      kept.push_back(std::move(child));
      continue;
    }
    const std::string stem = found[1];
    const size_t index = std::stoul(found[2].str().substr(0, 4));
    auto place = std::find_if(kept.begin(), kept.end(), [&](const Node& n) { return n.key == stem && n.is_list; });
    if (place == kept.end()) place = kept.insert(kept.end(), Node{stem, "", true, {}});
    if (place->children.size() == index) place->children.push_back({fmt::format("[{}]", index), child.text, false, {}});
  }
  node.children = std::move(kept);
}

/// A list of numbers, a list of equal lists of numbers, or a text of numbers.
std::optional<Numbers> numbers_of_node(const Node& node) {
  if (node.children.empty()) return numbers_in(node.text);
  if (!node.is_list) return std::nullopt;
  Numbers all;
  all.rows = 0;
  size_t columns = 0;
  bool nested = false;
  for (const Node& child : node.children) {
    const auto numbers = numbers_of_node(child);
    if (!numbers || (columns > 0 && numbers->values.size() != columns)) return std::nullopt;
    columns = numbers->values.size();
    nested = nested || child.is_list || columns > 1;
    all.values.insert(all.values.end(), numbers->values.begin(), numbers->values.end());
    ++all.rows;
  }
  if (!nested) all.rows = 1;
  return all;
}

void flatten(Node& node, const std::string& path, std::vector<CalibrationEntry>& entries) {
  gather_numbered(node);
  const auto add = [&](const Numbers& numbers, int rows) {
    const bool fits = rows > 0 && numbers.values.size() % static_cast<size_t>(rows) == 0;
    CalibrationEntry entry{path, "", numbers.values, fits ? rows : numbers.rows, 0};
    entry.cols = static_cast<int>(numbers.values.size()) / entry.rows;
    entries.push_back(std::move(entry));
  };
  if (const Node* data = node.child("data")) {
    if (const auto numbers = numbers_of_node(*data)) {
      const Node* rows = node.child("rows");
      const auto stated = rows ? numbers_in(rows->text) : std::nullopt;
      return add(*numbers, stated && stated->values[0] < 1e6 ? static_cast<int>(stated->values[0]) : 0);
    }
  }
  if (const auto numbers = numbers_of_node(node)) return add(*numbers, numbers->rows);
  if (node.children.empty() && !path.empty()) entries.push_back({path, node.text, {}, 0, 0});
  for (Node& child : node.children) {
    const bool is_index = child.key.starts_with('[');
    flatten(child, path.empty() || is_index ? path + child.key : path + "." + child.key, entries);
  }
}

/// "calib.left.intrinsic.txt" without the dots, which separate keys.
std::string name_as_key(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

std::string content_of(const std::filesystem::path& file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a calibration file", file.string(), obstacle));
  std::stringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

void refuse_binary(const std::filesystem::path& file, const std::string& content) {
  const auto refuse = [&](const char* what) {
    throw BadInput(
        fmt::format("{}: {}; expected a text file (YAML, XML, JSON, INI) with both camera matrices, their "
                    "distortion, R and T",
                    file.string(), what));
  };
  if (content.starts_with("\x93NUMPY"))
    refuse(file.filename() == "poses_bounds.npy"
               ? "it holds poses and depth bounds of one camera (LLFF), which are no stereo calibration"
               : "a NumPy array holds one matrix without its name: write all of them with yaml or json (.tolist())");
  if (content.starts_with("PK\x03\x04"))
    refuse("a NumPy archive (or a zip): write its arrays with yaml or json (.tolist())");
  if (content.starts_with("MATLAB 5.0") || content.starts_with("\x89HDF"))
    refuse("a MATLAB workspace: write jsonencode(toStruct(stereoParams)) into a file");
  if (content.starts_with("\x80")) refuse("a Python pickle: write its arrays with yaml or json (.tolist())");
  if (content.substr(0, 4096).find('\0') != std::string::npos && !content.starts_with("\xFF\xFE") &&
      !content.starts_with("\xFE\xFF"))
    refuse("it is binary");
}

}  // namespace

std::vector<CalibrationEntry> read_calibration_tree(const std::filesystem::path& file) {
  const std::string content = content_of(file);
  refuse_binary(file, content);
  std::string text = as_utf8(content);
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
  const size_t begin = text.find_first_not_of(" \t\n");
  static const std::regex kFirstLineOfIni(R"((\s*[;#][^\n]*\n)*\s*\[[A-Za-z][^\]=,\n]*\][ \t]*\n[\s\S]*)");
  const std::string head = text.substr(0, 4096);
  Node root;
  std::string why;
  try {
    if (begin != std::string::npos && text[begin] == '<')
      root = parse_xml(text);
    else if (!std::regex_match(head, kFirstLineOfIni))
      root = parse_yaml(text);
  } catch (const YAML::Exception& error) {
    why = error.what();
  } catch (const boost::property_tree::ptree_error& error) {
    throw BadInput(fmt::format("{}: the calibration cannot be read as XML ({})", file.string(), error.what()));
  }
  const bool looks_like_yaml =
      head.find("%YAML") != std::string::npos || head.find("opencv-matrix") != std::string::npos;
  if (root.children.empty() && !looks_like_yaml) root = parse_text(text, name_as_key(file));
  std::vector<CalibrationEntry> entries;
  flatten(root, "", entries);
  if (entries.empty())
    throw BadInput(fmt::format("{}: the calibration cannot be read as YAML, XML, JSON or INI{}", file.string(),
                               why.empty() ? "" : " (" + why + ")"));
  return entries;
}

bool is_bare_numbers(const std::filesystem::path& file) {
  constexpr std::uintmax_t kLargest = 1 << 16;
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || size == 0 || size > kLargest) return false;
  std::stringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return numbers_in(text.str()).has_value();
}

}  // namespace palpate
