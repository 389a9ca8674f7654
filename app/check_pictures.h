#pragma once

#include <filesystem>

#include "app/run.h"

namespace palpate::app {

/// What lets an operator see at a glance whether to trust the input: `instruments.png` (mask, axis and tip of ten
/// frames, both cameras) and `rectified.png` (the map frame with lines along its rows). Follows the instruments through
/// the whole recording. Throws Unfinished.
void write_check_pictures(const SceneFile& scene_file, const BuiltMap& built, const std::filesystem::path& folder,
                          bool quiet);

}  // namespace palpate::app
