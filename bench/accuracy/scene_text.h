#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// One key of a scene file by its dotted name ("contact.footprint_radius_mm") and what to put there.
struct SceneChange {
  std::string key;
  YAML::Node value;
};

/// A copy of the scene with other values; keys that are not there are made.
YAML::Node changed(const YAML::Node& scene, const std::vector<SceneChange>& changes);

/// The value of a key; undefined where the scene has none.
YAML::Node value_at(const YAML::Node& scene, const std::string& key);

/// A scene file as text, its files named so that the text may stand in any folder. Throws BadInput when it cannot be
/// read.
YAML::Node load_scene(const std::filesystem::path& file);

std::string scene_text(const YAML::Node& scene);

/// Writes a scene file. Throws Unfinished.
void save_scene(const YAML::Node& scene, const std::filesystem::path& file);

}  // namespace palpate
