#include "palpate/session/root_folder.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

void collect_sources(const YAML::Node& node, std::vector<std::string>& sources) {
  if (node.IsScalar()) {
    const std::string& text = node.Scalar();
    if (text.starts_with('/') || text.find(" ! ") != std::string::npos || text.find("://") != std::string::npos)
      sources.push_back(text);
    return;
  }
  for (const auto& part : node) collect_sources(node.IsMap() ? part.second : part, sources);
}

}  // namespace

RootFolder::RootFolder(const std::filesystem::path& folder) {
  std::error_code error;
  folder_ = std::filesystem::canonical(folder.empty() ? "." : folder, error);
  if (error || !std::filesystem::is_directory(folder_))
    throw BadInput(fmt::format("--root is {}, expected a folder", folder.string()));
}

bool RootFolder::holds(const std::filesystem::path& file) const {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::weakly_canonical(file, error);
  if (error) return false;
  const auto [of_root, of_file] = std::mismatch(folder_.begin(), folder_.end(), real.begin(), real.end());
  return of_root == folder_.end();
}

std::filesystem::path RootFolder::inside(const std::string& relative) const {
  const bool is_text = std::none_of(relative.begin(), relative.end(), [](char c) { return c == '\0'; });
  std::filesystem::path file = (folder_ / relative).lexically_normal();
  if (!is_text || !holds(file))
    throw BadInput(
        fmt::format("'{}' is outside of the folder that this page may open, {}", relative, folder_.string()));
  return file;
}

std::string RootFolder::name_of(const std::filesystem::path& file) const {
  return holds(file) ? std::filesystem::weakly_canonical(file).lexically_relative(folder_).string() : file.string();
}

void RootFolder::require_holds_all(const SceneFile& scene, const std::vector<std::string>& trusted) const {
  for (const std::string& source : sources_of(scene)) {
    if (std::find(trusted.begin(), trusted.end(), source) != trusted.end()) continue;
    if (source.starts_with('/') && source.find(" ! ") == std::string::npos && holds(source)) continue;
    throw BadInput(fmt::format(
        "{} is outside of the folder that this page may open, {}; palpate console SCENE.yaml --root FOLDER opens it",
        source, folder_.string()));
  }
}

std::vector<std::string> sources_of(const SceneFile& scene) {
  std::vector<std::string> sources;
  SceneFile read = scene;
  read.has_simulate = false;
  collect_sources(YAML::Load(write_scene_file(read)), sources);
  // A device is a mere number.
  const RecordingOptions& recording = scene.scene.recording;
  for (const std::filesystem::path& eye : {recording.left, recording.right, recording.stereo})
    if (!eye.empty() && eye.string().find_first_not_of("0123456789") == std::string::npos)
      sources.push_back(eye.string());
  return sources;
}

}  // namespace palpate
