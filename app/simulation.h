#pragma once

#include <filesystem>

#include "palpate/session/scene_file.h"
#include "palpate/simulate/dejavu.h"

namespace palpate::app {

/// The paper's uterus as `palpate demo` simulates and estimates it.
SceneFile demo_scene();

/// DejaVu's recording in `folder` and, beside it, the estimator's own scene.yaml; returns that scene as read back.
SceneFile simulate_into(const SceneFile& simulated, const std::filesystem::path& folder, bool quiet,
                        DejaVuSummary& summary);

}  // namespace palpate::app
