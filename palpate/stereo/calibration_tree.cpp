#include "palpate/stereo/calibration_tree.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <functional>
#include <optional>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/core/whole_file.h"
#include "palpate/core/yaml_tree.h"

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
  if (token == ".inf" || token == "inf" || token == "+.inf") return HUGE_VAL;
  if (token == "-.inf" || token == "-inf") return -HUGE_VAL;
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

/// `Camera-0-F: 1068.2 1068.1  // focal length in pixels`; no address has a blank before its slashes.
std::string without_remarks(const std::string& text) {
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    for (size_t at = line.find("//"); at != std::string::npos; at = line.find("//", at + 1))
      if (at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t') line.erase(at);
    result += line + "\n";
  }
  return result;
}

/// The file is YAML, and one of two values would be left out.
struct TwinKey : YAML::ParserException {
  using YAML::ParserException::ParserException;
};

Node from_yaml(const YAML::Node& yaml, const std::string& key) {
  Node node{key, "", yaml.IsSequence(), {}};
  if (yaml.IsScalar()) node.text = yaml.Scalar();
  if (yaml.IsSequence())
    for (size_t i = 0; i < yaml.size(); ++i) node.children.push_back(from_yaml(yaml[i], fmt::format("[{}]", i)));
  if (yaml.IsMap())
    for (const auto& child : yaml) {
      if (!child.first.IsScalar()) continue;
      const std::string& name = child.first.Scalar();
      if (node.child(name)) throw TwinKey(child.first.Mark(), name + " stands there twice, expected once");
      node.children.push_back(from_yaml(child.second, name));
    }
  return node;
}

/// But for what is no calibration: stamp and number of a message.
bool says_the_same(const Node& a, const Node& b) {
  if (a.key == "header" && b.key == "header") return true;
  return a.text == b.text &&
         std::equal(a.children.begin(), a.children.end(), b.children.begin(), b.children.end(),
                    [](const Node& x, const Node& y) { return x.key == y.key && says_the_same(x, y); });
}

/// YAML and JSON. `%YAML:1.0` of FileStorage is no YAML; tabs of JSON are none either.
Node parse_yaml(const std::string& text) {
  std::string plain;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    plain += (line.starts_with("%YAML") ? "" : line) + "\n";  // lines keep their numbers
  std::replace(plain.begin(), plain.end(), '\t', ' ');
  Node root;
  for (const YAML::Node& document : load_documents(plain)) {
    if (document.IsMap() || document.IsSequence())
      root.children.push_back(from_yaml(document, fmt::format("[{}]", root.children.size())));
  }
  // `rostopic echo` goes on with the same message under another stamp.
  std::erase_if(root.children, [&](const Node& document) {
    return &document != &root.children.front() && says_the_same(root.children.front(), document);
  });
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

/// The reader of XML takes the stack for every tag within a tag.
void require_shallow(const std::string& text) {
  constexpr int kDeepest = 100;
  int depth = 0;
  for (size_t at = text.find('<'); at != std::string::npos && at + 1 < text.size(); at = text.find('<', at + 1)) {
    const size_t end = text.find('>', at);
    const bool is_mark = text[at + 1] == '?' || text[at + 1] == '!';
    if (text[at + 1] == '/')
      --depth;
    else if (!is_mark && (end == std::string::npos || text[end - 1] != '/'))
      ++depth;
    if (depth > kDeepest) throw boost::property_tree::ptree_error("it is nested too deeply");
  }
}

Node parse_xml(const std::string& text) {
  require_shallow(text);
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

bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}

/// "StereoLeft" of "[StereoLeft]"; empty where the line is none. By hand, as all that follows: the standard library's
/// regular expressions take the stack for every letter of what they match.
std::string section_in(const std::string& line) {
  const bool is_section = line.size() > 2 && line.front() == '[' && line.back() == ']' && is_letter(line[1]) &&
                          line.find_first_of("=,") == std::string::npos && line.find(']') == line.size() - 1;
  return is_section ? line.substr(1, line.size() - 2) : "";
}

/// "fx" and "705" of "fx = 705" or "fx: 705"; empty where the line is none.
std::pair<std::string, std::string> pair_in(const std::string& line) {
  const size_t cut = line.find_first_of("=:");
  if (cut == std::string::npos || !is_letter(line[0])) return {};
  const std::string key(trimmed(std::string_view(line).substr(0, cut)));
  const bool is_name = std::all_of(key.begin(), key.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == ' ' || c == '.' || c == '-';
  });
  if (!is_name) return {};
  return {key, std::string(trimmed(std::string_view(line).substr(cut + 1)))};
}

/// "fc_x = 350 ; px" without its remark; the semicolon of "1 0 0 ; 0 1 0" ends a row.
std::string without_remark(const std::string& line) {
  for (size_t at = line.find_first_of(";#"); at != std::string::npos; at = line.find_first_of(";#", at + 1)) {
    const bool is_apart = at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t';
    if (is_apart && (line[at] == '#' || !numbers_in(line.substr(at + 1)))) return line.substr(0, at);
  }
  return line;
}

/// The first line that is no remark is a [section].
bool begins_with_section(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = std::string(trimmed(without_remark(line)));
    if (line.empty()) continue;
    return !section_in(line).empty();
  }
  return false;
}

/// Where the number begins in "kc_0"; npos where there is none.
size_t number_at_end(const std::string& key) {
  const size_t digits = key.find_last_not_of("0123456789");
  const bool is_numbered = digits != std::string::npos && digits > 0 && digits + 1 < key.size() && key[digits] == '_' &&
                           is_letter(key[digits - 1]);
  return is_numbered ? digits + 1 : std::string::npos;
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
  std::string section, heading = name;
  Node* rows = nullptr;
  size_t row_length = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = std::string(trimmed(without_remark(line)));
    if (line.empty() || line.starts_with("//")) continue;
    if (const auto numbers = numbers_in(line)) {
      const bool continues = rows && numbers->values.size() == row_length && row_length > 1;
      if (!continues) rows = &add(section, heading);
      rows->text += (continues ? "; " : "") + line;
      row_length = numbers->values.size();
    } else if (const std::string name_of_section = section_in(line); !name_of_section.empty()) {
      section = name_of_section;
      rows = nullptr;
    } else if (const auto [key, value] = pair_in(line); !value.empty()) {
      add(section, key).text = value;
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
  std::vector<Node> kept;
  for (Node& child : node.children) {
    const size_t number = number_at_end(child.key);
    const bool is_scalar =
        child.children.empty() && numbers_in(child.text) && numbers_in(child.text)->values.size() == 1;
    if (!is_scalar || number == std::string::npos) {
      kept.push_back(std::move(child));
      continue;
    }
    const std::string stem = child.key.substr(0, number - 1);
    const auto index = static_cast<size_t>(number_of(std::string_view(child.key).substr(number, 4)));
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

/// What spoils a list of numbers: a word among them, or rows of different length; empty where it is no such list.
std::string spoiled_numbers(const Node& list) {
  size_t numbers = 0, words = 0;
  std::string first_word;
  const std::function<void(const Node&)> count = [&](const Node& node) {
    if (!node.children.empty() && !node.is_list) words += 1000;  // a group of keys
    for (const Node& child : node.children) count(child);
    if (!node.children.empty()) return;
    if (numbers_in(node.text)) return void(++numbers);
    if (words++ == 0) first_word = node.text;
  };
  count(list);
  if (!list.is_list || words >= numbers || numbers < 2) return "";
  return words > 0 ? fmt::format("'{}' among {} numbers", first_word, numbers) : "rows of different length";
}

void flatten(Node& node, const std::string& path, std::vector<CalibrationEntry>& entries) {
  gather_numbered(node);
  const auto add = [&](const Numbers& numbers, int rows) {
    const bool fits = rows > 0 && numbers.values.size() % static_cast<size_t>(rows) == 0;
    CalibrationEntry entry{path, "", numbers.values, fits ? rows : numbers.rows, 0, false};
    entry.cols = static_cast<int>(numbers.values.size()) / entry.rows;
    entries.push_back(std::move(entry));
  };
  if (const Node* data = node.child("data")) {
    if (const auto numbers = numbers_of_node(*data)) {
      const Node* rows = node.child("rows");
      const auto stated = rows ? numbers_in(rows->text) : std::nullopt;
      return add(*numbers,
                 stated && stated->values[0] > 0 && stated->values[0] < 1e6 ? static_cast<int>(stated->values[0]) : 0);
    }
    if (const std::string what = spoiled_numbers(*data); !what.empty())
      return entries.push_back({path, what, {}, 0, 0, true});
  }
  if (const auto numbers = numbers_of_node(node)) return add(*numbers, numbers->rows);
  if (const std::string what = spoiled_numbers(node); !what.empty())
    return entries.push_back({path, what, {}, 0, 0, true});
  if (node.children.empty() && !path.empty()) entries.push_back({path, node.text, {}, 0, 0, false});
  for (Node& child : node.children) {
    const bool is_index = child.key.starts_with('[');
    flatten(child, path.empty() || is_index ? path + child.key : path + "." + child.key, entries);
  }
}

/// "calib.left.intrinsic.txt" without the dots, which separate keys, and without what every such file ends with.
std::string name_as_key(const std::filesystem::path& file) {
  std::string name = (file.extension() == ".txt" ? file.stem() : file.filename()).string();
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

bool is_named_as_yaml(const std::filesystem::path& file) {
  const std::filesystem::path extension = file.extension();
  return extension == ".yaml" || extension == ".yml" || extension == ".json";
}

std::string content_of(const std::filesystem::path& file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a calibration file", file.string(), obstacle));
  return read_whole_file(file);
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
  std::string text = with_plain_minus(as_utf8(content));
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
  const size_t begin = text.find_first_not_of(" \t\n");
  const bool is_xml = begin != std::string::npos && text[begin] == '<';
  if (!is_xml) text = without_remarks(text);
  const std::string head = text.substr(0, 4096);
  const bool looks_like_yaml =
      head.find("%YAML") != std::string::npos || head.find("opencv-matrix") != std::string::npos;
  Node root;
  std::string why;
  try {
    if (is_xml)
      root = parse_xml(text);
    else if (!begins_with_section(text))
      root = parse_yaml(text);
  } catch (const TwinKey& error) {
    throw BadInput(fmt::format("{}:{}: {}", file.string(), error.mark.line + 1, error.msg));
  } catch (const YAML::Exception& error) {
    why = error.what();
    if (is_named_as_yaml(file) || looks_like_yaml)
      throw BadInput(fmt::format("{}:{}: not valid YAML: {}", file.string(), error.mark.line + 1, error.msg));
  } catch (const boost::property_tree::ptree_error& error) {
    throw BadInput(fmt::format("{}: the calibration cannot be read as XML ({})", file.string(), error.what()));
  }
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
  return numbers_in(read_whole_file(file)).has_value();
}

}  // namespace palpate
