#pragma once

#include <filesystem>
#include <optional>

#include "app/scene_file.h"
#include "palpate/feedback/compare.h"

namespace palpate::app {

struct RunOptions {
  std::filesystem::path folder;
  std::filesystem::path truth;  ///< empty = none
  bool quiet = false;           ///< no progress, no sentences
};

/// Figures of one run, for people and machines.
struct RunSummary {
  int frames = 0;
  int elements = 0;
  double map_s = 0;
  double median_frame_ms = 0;
  double p99_frame_ms = 0;
  double peak_force_N = 0;
  std::map<std::string, int> frames_by_status;
  std::optional<Comparison> comparison;
};

/// A map and the frame it was built from.
struct BuiltMap {
  StereoFrame frame;
  Rectification rectification;
  TissueMap map;
};

/// The build stage of a scene: opens the recording, reads up to the map frame, builds. Throws BadInput, Unfinished.
BuiltMap build_map(const SceneFile& scene_file, bool quiet);

/// map.vtu, surface.ply, cloud.ply, preview.png, map.json.
void write_map_files(const BuiltMap& built, const std::filesystem::path& folder);

/// Both stages of a scene, with every file of the contract. Nothing is written before the map stands. Throws BadInput;
/// throws Unfinished when the video ends early or the user interrupts, with all rows and pictures so far on the disk.
RunSummary run_estimate(const SceneFile& scene_file, const RunOptions& options);

std::string to_text(const RunSummary& summary);
std::string to_json(const RunSummary& summary);

}  // namespace palpate::app
