#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "palpate/estimate/build_stages.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/session/scene_file.h"
#include "palpate/stereo/recording.h"

namespace palpate {

/// A map, and the frame and recording it was built from.
struct BuiltMap {
  double fps = 0;
  int frame_count = -1;  ///< -1 = unknown
  RecordingTiming timing;
  std::vector<std::string> notes;  ///< sentences on recording and calibration that a user ought to know
  StereoFrame frame;
  Rectification rectification;
  TissueMap map;
};

/// Who is told how a build goes.
struct BuildWatch {
  /// What was found on the way, for people: "calibration", "recording", "note" or "warning", and a sentence.
  std::function<void(const std::string& what, const std::string& sentence)> told = [](const auto&, const auto&) {};
  OnStage on_stage = [](const std::string&) {};
};

/// The recording of a scene. Throws BadInput with a sentence that names the scene file.
std::shared_ptr<Recording> open_recording(const SceneFile& scene_file);

/// The build stage of a scene: opens all that the scene names, reads up to the map frame, builds. Of a live source it
/// is the first frame from map.frame on that shows something in both cameras; its index is -1, before any run. Throws
/// BadInput with a sentence that names the scene file, Unfinished.
BuiltMap build_map(const SceneFile& scene_file, Recording& recording, const BuildWatch& watch);

/// The map of another frame of the same recording, which becomes the state at rest. Throws BadInput.
BuiltMap build_map_again(const SceneFile& scene_file, const BuiltMap& before, const StereoFrame& frame,
                         const OnStage& on_stage);

/// map.vtu, surface.ply, cloud.ply, preview.png, confidence.png, map.json. Throws Unfinished.
void write_map_files(const BuiltMap& built, const std::filesystem::path& folder);

}  // namespace palpate
