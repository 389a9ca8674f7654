#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

#include "bench/accuracy/scene_text.h"
#include "palpate/session/scene_file.h"

namespace palpate {

/// A recording with known force.
struct Sequence {
  std::string name;
  YAML::Node scene;             ///< what the estimator is told
  std::filesystem::path truth;  ///< truth.csv; truth_2.csv beside it where there is a second instrument
};

/// DejaVu's recording of a scene in `folder`: made when it is not there or was made of another scene text. Throws
/// BadInput, Unfinished.
Sequence rendered(const std::string& name, const YAML::Node& scene, const std::filesystem::path& folder);

/// Whether `folder` holds the recording of this scene.
bool is_rendered(const YAML::Node& scene, const std::filesystem::path& folder);

/// What DejaVu is told of a scene, as text: what changes the recording, and no more.
YAML::Node dejavu_text(const SceneFile& scene);

/// Names of the static sequences: rendered_uterus, rendered_liver, demo, and those of studies/.
std::vector<std::string> static_sequences();
/// Whether DejaVu makes it, so that it can be made with other looks and motions.
bool is_dejavu(const std::string& name);

/// The scene that DejaVu makes a sequence of, with look and noise number `seed` (0 = its own).
YAML::Node dejavu_scene(const std::string& name, int seed);

/// rendered_uterus or rendered_liver. Throws BadInput where PALPATE_REFERENCE_DATA does not hold it.
Sequence reference_sequence(const std::string& name);

}  // namespace palpate
