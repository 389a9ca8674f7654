#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "palpate/session/built_map.h"
#include "palpate/session/scene_file.h"

namespace palpate {

/// What is kept of a live source.
struct KeptView {
  std::filesystem::path folder;
  int frames = 0;
  double seconds = 0;
  int left_out = 0;  ///< frames that came faster than they could be written
  bool over = false;
  std::string end;  ///< why it ended before it was stopped; empty = it did not
};

/// Keeps every frame of a live source in a folder of its own: left.mp4 and right.mp4 with the stamps of their frames,
/// times.csv, calibration.yaml, and a scene.yaml that means the same.
class LiveRecorder {
 public:
  /// Begins. `scene_text` is what the scene's file says. Where there is a map, its picture is the first frame, so that
  /// the scene builds the same map again. Throws Unfinished.
  LiveRecorder(std::shared_ptr<Recording> live, const SceneFile& scene, const std::string& scene_text,
               const BuiltMap* map, const std::filesystem::path& folder);
  ~LiveRecorder();

  KeptView view() const;
  /// Ends it; what has come is written.
  KeptView close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The scene of such a folder: its recording is that of the folder, and files that the scene names are found from
/// there. Throws BadInput.
std::string kept_scene_text(const std::string& scene_text, const std::filesystem::path& scene_folder,
                            const std::filesystem::path& folder, bool begins_with_map);

}  // namespace palpate
