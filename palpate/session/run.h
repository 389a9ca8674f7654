#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "palpate/estimate/force_estimator.h"
#include "palpate/session/built_map.h"
#include "palpate/session/run_files.h"

namespace palpate {

struct RunControl {
  bool realtime = false;  ///< the recording at its own rate; frames whose time is over are passed over
  /// Asked between frames and while it waits for one; true ends the run, and that is told as a loss.
  std::function<bool()> stopped = [] { return false; };
};

/// The compute stage over the frames of a map. `streams`: what a live track comes from. Throws BadInput.
ForceEstimator make_estimator(const SceneFile& scene_file, const BuiltMap& built, const StreamHub* streams = nullptr);

/// One pass over a recording, with every file of the contract.
class Run {
 public:
  /// Empties `folder` of earlier results, writes the map's files and begins the others. `scene_file` and `built` have
  /// to live as long. `live`: a live source that is open already; a recording is read from its beginning. Throws
  /// BadInput, Unfinished.
  Run(const SceneFile& scene_file, const BuiltMap& built, const std::filesystem::path& folder, Truths truths,
      const RunControl& options, std::shared_ptr<Recording> live = nullptr);
  ~Run();

  /// The next frame, its answer on the disk; nothing at the end, which is also where the recording spoils, the disk is
  /// full or it is stopped: the losses say which. To be stopped is how a live source ends, and no loss.
  std::optional<RunFrame> next();

  /// Goes on from another map of the same recording, which has to live as long: its frame is the state at rest.
  /// Throws BadInput; the run goes on as before then.
  void take_map(const BuiltMap& built);

  /// Ends the video, writes run.yaml and report.html.
  void close();

  int frame_count() const;  ///< -1 when unknown
  int dropped() const;      ///< frames of a live source that a newer one replaced before they were looked at
  std::vector<std::string> damages() const;  ///< sentences about damaged frames so far
  const RunFiles& files() const;
  const StreamHub& streams() const;
  /// Both pictures of the last frame.
  const StereoFrame& last_frame() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
