#pragma once

#include <filesystem>
#include <string>

#include "palpate/estimate/scene.h"
#include "palpate/feedback/overlay.h"
#include "palpate/simulate/simulate_options.h"
#include "palpate/stream/stream_options.h"

namespace palpate {

/// A scene file as the program knows it: what is estimated, what is simulated, how it is shown.
struct SceneFile {
  std::filesystem::path file;
  Scene scene;
  OverlayOptions overlay;
  SimulateOptions simulate;
  StreamOptions streams;
  Mat3 rectified_from_left = Mat3::Identity();  ///< what a run found; written into run.yaml, without effect when read
  /// Greatest force over E as [value, 2.5 %, 97.5 %], N per kPa: does not depend on the E assumed.
  Vec3 peak_force_per_modulus_N_per_kPa = Vec3::Zero();
  int dropped_frames = 0;
  bool has_recording = false;
  bool has_simulate = false;
  bool has_streams = false;
  bool has_run = false;
};

void describe(Settings& settings, SceneFile& scene_file);

/// Throws BadInput; `needs_recording`: the file must name a recording.
SceneFile read_scene_file(const std::filesystem::path& file, bool needs_recording);

/// Every setting in effect, as YAML.
std::string write_scene_file(SceneFile scene_file);

/// docs/scene.md: every key with its default, values and meaning.
std::string document_scene_file();

}  // namespace palpate
