#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

namespace YAML {
class Node;
}

namespace palpate {

/// Both ends included unless `open_*` says otherwise.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool open_min = false;
  bool open_max = false;

  bool contains(double value) const;
  std::string text() const;  ///< "0 < x <= 100"
};

/// Where a value stands in a file, for error sentences, and against what relative paths are resolved.
struct SettingsContext {
  std::filesystem::path file;
  std::filesystem::path folder;
};

/// One group of YAML keys bound to the fields of an options struct. Each options struct has, beside it, a function
///
///     void describe(Settings& settings, ContactOptions& options);
///
/// that binds every field once. From that one description come the reading (unknown keys and values out of range are
/// BadInput sentences with file and line), the writing (run.yaml) and the documentation (docs/scene.md).
class Settings {
 public:
  Settings();
  ~Settings();
  Settings(Settings&&) noexcept;
  Settings& operator=(Settings&&) noexcept;

  void number(const std::string& key, double& field, Range range, const std::string& doc);
  /// A number, or `word`, which sets `is_word` and leaves the number.
  void number_or_word(const std::string& key, double& field, Range range, const std::string& word, bool& is_word,
                      const std::string& doc);
  void integer(const std::string& key, int& field, Range range, const std::string& doc);
  void flag(const std::string& key, bool& field, const std::string& doc);
  void text(const std::string& key, std::string& field, const std::string& doc);
  /// A file or folder: ${NAME} is replaced from the environment, relative paths start at the settings file.
  void path(const std::string& key, std::filesystem::path& field, const std::string& doc);
  void vector3(const std::string& key, Eigen::Vector3d& field, Range range, const std::string& doc);
  /// [[..], [..], [..]], row by row.
  void matrix3(const std::string& key, Eigen::Matrix3d& field, const std::string& doc);
  void pixel(const std::string& key, cv::Point2d& field, const std::string& doc);
  /// [x, y, width, height]
  void rectangle(const std::string& key, cv::Rect2d& field, const std::string& doc);
  /// [x, y], or [[x, y], ...] with at least three corners.
  void points(const std::string& key, std::vector<cv::Point2d>& field, const std::string& doc);
  /// [[x, y], ...], at least three corners.
  void polygon(const std::string& key, std::vector<cv::Point2d>& field, const std::string& doc);

  /// One word out of a list.
  template <class Enum>
  void choice(const std::string& key, Enum& field, const std::vector<std::pair<std::string, Enum>>& words,
              const std::string& doc) {
    std::vector<std::string> names;
    for (const auto& word : words) names.push_back(word.first);
    choice_by_index(
        key, names,
        [&field, words] {
          for (size_t i = 0; i < words.size(); ++i)
            if (words[i].second == field) return static_cast<int>(i);
          return 0;
        },
        [&field, words](int index) { field = words[static_cast<size_t>(index)].second; }, doc);
  }

  /// Words out of a list, [] for none.
  template <class Enum>
  void choices(const std::string& key, std::vector<Enum>& field, const std::vector<std::pair<std::string, Enum>>& words,
               const std::string& doc) {
    std::vector<std::string> names;
    for (const auto& word : words) names.push_back(word.first);
    choices_by_index(
        key, names,
        [&field, words] {
          std::vector<int> indices;
          for (const Enum& value : field)
            for (size_t i = 0; i < words.size(); ++i)
              if (words[i].second == value) indices.push_back(static_cast<int>(i));
          return indices;
        },
        [&field, words](const std::vector<int>& indices) {
          field.clear();
          for (int index : indices) field.push_back(words[static_cast<size_t>(index)].second);
        },
        doc);
  }

  /// One word out of a list, or a file whose name ends with `extension`, for which `of_file` stands.
  template <class Enum>
  void choice_or_file(const std::string& key, Enum& field, const std::vector<std::pair<std::string, Enum>>& words,
                      Enum of_file, const std::string& extension, std::filesystem::path& file, const std::string& doc) {
    std::vector<std::string> names;
    for (const auto& word : words) names.push_back(word.first);
    choice_by_index(
        key, names,
        [&field, words] {
          size_t index = 0;
          while (index < words.size() && words[index].second != field) ++index;
          return static_cast<int>(index);
        },
        [&field, words, of_file](int index) {
          field = index < static_cast<int>(words.size()) ? words[static_cast<size_t>(index)].second : of_file;
        },
        doc, extension, &file);
  }

  /// A nested group. `present`, if given, becomes true when the key stands in the file; when it is false on writing,
  /// the group is left out.
  void group(const std::string& key, const std::string& doc, const std::function<void(Settings&)>& describe_group,
             bool* present = nullptr);

  /// A list of nested groups: `resize(n)` first, then `describe_item(settings, i)` for each.
  void list(const std::string& key, const std::string& doc, const std::function<int()>& count,
            const std::function<void(int)>& resize, const std::function<void(Settings&, int)>& describe_item);

  /// Keys that the design knows and this version does not have yet: refused with a sentence that says so. "[1]" = a
  /// second item where one group stands.
  void not_yet(const std::vector<std::string>& keys);

  /// The file must name this key.
  void require(const std::string& key);

  /// Called when the whole group has been read, to check what concerns several keys (throw BadInput).
  void after_reading(const std::function<void()>& check);

 private:
  friend void read_settings(const YAML::Node&, const SettingsContext&, Settings&, const std::string&);
  friend std::string write_settings(const Settings&);
  friend std::string document_settings(const Settings&, const std::string&);

  void choices_by_index(const std::string& key, const std::vector<std::string>& names,
                        const std::function<std::vector<int>()>& get,
                        const std::function<void(const std::vector<int>&)>& set, const std::string& doc);

  /// The index after the last name stands for `file`, where there is one.
  void choice_by_index(const std::string& key, const std::vector<std::string>& names, const std::function<int()>& get,
                       const std::function<void(int)>& set, const std::string& doc, const std::string& extension = "",
                       std::filesystem::path* file = nullptr);

  struct Entry;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::vector<std::string> not_yet_;
  std::vector<std::function<void()>> checks_;
};

/// Reads `node` (a map) into the bound fields. `prefix` names the group in error sentences ("map.").
/// Throws BadInput: unknown key (with the nearest valid one), wrong type, value out of range, missing key.
void read_settings(const YAML::Node& node, const SettingsContext& context, Settings& settings,
                   const std::string& prefix = "");

/// Reads a whole YAML file; sentences name it as it is given here. Throws BadInput when it is missing or not YAML.
void read_settings_file(const std::filesystem::path& file, Settings& settings);

/// Every bound field as YAML text.
std::string write_settings(const Settings& settings);

/// A Markdown table of every key: name, default, range, meaning.
std::string document_settings(const Settings& settings, const std::string& prefix = "");

/// ${NAME} replaced from the environment. Throws BadInput when NAME is not set.
std::string expand_environment(const std::string& text);

/// The candidate with the smallest edit distance, or "" when none is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace palpate
