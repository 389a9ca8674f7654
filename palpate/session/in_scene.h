#pragma once

#include <string>

#include "palpate/core/errors.h"
#include "palpate/session/scene_file.h"

namespace palpate {

/// The sentence of a stage that knows no scene file, told with the file, and with `key` where it does not begin with
/// one.
std::string sentence_in_scene(const SceneFile& scene_file, const std::string& key, const std::string& sentence);

/// Runs a stage that knows no scene file; what it finds bad is told with the file and the key.
template <class Stage>
auto in_scene(const SceneFile& scene_file, const std::string& key, const Stage& stage) {
  try {
    return stage();
  } catch (const BadInput& error) {
    throw BadInput(sentence_in_scene(scene_file, key, error.what()));
  }
}

}  // namespace palpate
