#include "bench/accuracy/scene_text.h"

#include <fmt/format.h>

#include <fstream>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

// Keys that name files.
const char* const kFiles[] = {"recording.left", "recording.right", "recording.stereo", "recording.calibration",
                              "map.volume"};

/// Nodes share what they hold: every map on the way is copied.
YAML::Node with_value(const YAML::Node& scene, const std::string& key, const YAML::Node& value) {
  YAML::Node copy = scene.IsDefined() ? YAML::Clone(scene) : YAML::Node(YAML::NodeType::Map);
  const size_t dot = key.find('.');
  const std::string name = key.substr(0, dot);
  if (dot == std::string::npos)
    copy[name] = YAML::Clone(value);
  else
    copy[name] = with_value(std::as_const(copy)[name], key.substr(dot + 1), value);
  return copy;
}

}  // namespace

YAML::Node value_at(const YAML::Node& scene, const std::string& key) {
  const size_t dot = key.find('.');
  const YAML::Node found = scene[key.substr(0, dot)];
  if (dot == std::string::npos || !found.IsDefined()) return found;
  return value_at(found, key.substr(dot + 1));
}

YAML::Node changed(const YAML::Node& scene, const std::vector<SceneChange>& changes) {
  YAML::Node result = YAML::Clone(scene);
  for (const SceneChange& change : changes) result.reset(with_value(result, change.key, change.value));
  return result;
}

YAML::Node load_scene(const std::filesystem::path& file) {
  try {
    const YAML::Node scene = YAML::LoadFile(file.string());
    std::vector<SceneChange> changes;
    for (const char* key : kFiles)
      if (const YAML::Node named = value_at(scene, key); named.IsDefined())
        changes.push_back({key, YAML::Node(std::filesystem::absolute(file.parent_path() / named.Scalar()).string())});
    return changed(scene, changes);
  } catch (const YAML::Exception& error) {
    throw BadInput(fmt::format("{}: {}", file.string(), error.what()));
  }
}

std::string scene_text(const YAML::Node& scene) {
  return YAML::Dump(scene) + "\n";
}

void save_scene(const YAML::Node& scene, const std::filesystem::path& file) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream stream(file);
  stream << scene_text(scene);
  if (!stream.flush()) throw Unfinished(file.string() + ": cannot be written");
}

}  // namespace palpate
