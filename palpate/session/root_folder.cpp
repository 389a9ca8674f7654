#include "palpate/session/root_folder.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "palpate/core/errors.h"
#include "palpate/core/source_kind.h"

namespace palpate {

namespace {

void collect_sources(const YAML::Node& node, std::vector<std::string>& sources) {
  if (node.IsScalar()) {
    const std::string& text = node.Scalar();
    const SourceKind kind = kind_of_source(text);
    if (text.starts_with('/') || kind == SourceKind::pipeline || kind == SourceKind::address) sources.push_back(text);
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

void RootFolder::require_holds_all(const SceneFile& scene, const std::vector<std::string>& trusted,
                                   bool may_open_live) const {
  for (const std::string& source : sources_of(scene)) {
    if (std::find(trusted.begin(), trusted.end(), source) != trusted.end()) continue;
    const bool is_file = kind_of_source(source) == SourceKind::file;
    if (is_file ? holds(source) : may_open_live) continue;
    if (!is_file)
      throw BadInput(fmt::format("{} is a live source; palpate console --live lets this page open those", source));
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
  for (const std::filesystem::path& camera : {recording.left, recording.right, recording.stereo})
    if (kind_of_source(camera.string()) == SourceKind::device) sources.push_back(camera.string());
  return sources;
}

}  // namespace palpate
