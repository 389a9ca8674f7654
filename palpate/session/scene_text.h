#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/session/scene_file.h"

namespace palpate {

/// What a text says that stands, or is to stand, in `file`. Throws BadInput: no YAML, or what read_scene_file refuses;
/// the scene must name a recording.
SceneFile read_scene_text(const std::string& text, const std::filesystem::path& file);

/// The text of a scene around a recording, with the least that a scene needs; names relative to the scene's folder,
/// `stereo` or `left` and `right` empty.
std::string new_scene_text(const std::string& left, const std::string& right, const std::string& stereo,
                           const std::string& calibration);

/// One key of the scene file, as docs/scene.md tells it: "map.thickness_mm", "25", "0 < x <= 500", what it means.
struct KeyRow {
  std::string key;
  std::string default_text;  ///< "required" where the file must name it
  std::string values;
  std::string meaning;
};

/// Every key, from the program's own description of its settings.
std::vector<KeyRow> scene_keys();

}  // namespace palpate
