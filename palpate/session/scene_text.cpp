#include "palpate/session/scene_text.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/core/yaml_tree.h"

namespace palpate {

namespace {

/// "| `key` | `default` | values | meaning |" -> its cells.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  size_t begin = 2;
  while (cells.size() < 3) {
    const size_t end = line.find(" | ", begin);
    if (end == std::string::npos) return {};
    cells.push_back(line.substr(begin, end - begin));
    begin = end + 3;
  }
  cells.push_back(line.substr(begin, line.size() - begin - 2));
  for (std::string& cell : cells)
    if (cell.size() >= 2 && cell.front() == '`' && cell.back() == '`') cell = cell.substr(1, cell.size() - 2);
  return cells;
}

}  // namespace

SceneFile read_scene_text(const std::string& text, const std::filesystem::path& file) {
  YAML::Node root;
  try {
    root = YAML::Load(text);
    require_tree(root);
  } catch (const YAML::Exception& error) {
    throw BadInput(fmt::format("{}:{}: not valid YAML: {}", file.string(), error.mark.line + 1, error.msg));
  }
  SceneFile scene_file;
  scene_file.file = file;
  Settings settings;
  describe(settings, scene_file);
  read_settings(root, {file, std::filesystem::absolute(file).parent_path()}, settings);
  if (!scene_file.has_recording)
    throw BadInput(fmt::format("{}: recording is missing (the two videos and their calibration)", file.string()));
  return scene_file;
}

std::string new_scene_text(const std::string& left, const std::string& right, const std::string& stereo,
                           const std::string& calibration) {
  const auto quoted = [](const std::string& name) {
    std::string text = "\"";
    for (char c : name) text += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    return text + "\"";
  };
  const std::string cameras = stereo.empty() ? fmt::format("  left: {}\n  right: {}\n", quoted(left), quoted(right))
                                             : fmt::format("  stereo: {}\n", quoted(stereo));
  return fmt::format(
      "recording:\n{}  calibration: {}\nmap:\n  frame: 0\n  elements: 1344\n  thickness_mm: 25\ntissue:\n"
      "  preset: liver\nattachments:\n  - underside: {{depth_mm: 3}}\ninstrument: {{segmentation: learned}}\n"
      "contact: {{grip: auto}}\n",
      cameras, quoted(calibration));
}

std::vector<KeyRow> scene_keys() {
  std::vector<KeyRow> rows;
  std::istringstream lines(document_scene_file());
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() == 4) rows.push_back({cells[0], cells[1], cells[2], cells[3]});
  }
  return rows;
}

}  // namespace palpate
