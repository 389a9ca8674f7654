#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/session/built_map.h"
#include "palpate/session/live_recorder.h"
#include "palpate/session/row_log.h"
#include "palpate/session/run_files.h"

namespace palpate {

/// idle: no scene. ready: a scene with its source, perhaps with a map. failed: the last thing asked for could not be
/// done; all else is as in ready.
enum class Phase { idle, ready, building, running, failed };

std::string phase_name(Phase phase);

/// A recording that is open, and the frame of it that is looked at.
struct SourceView {
  cv::Size size;  ///< of one camera
  double fps = 0;
  int frame_count = -1;  ///< -1 = unknown
  RecordingTiming timing;
  std::vector<std::string> notes;
  Rectification rectification;
  StereoFrame frame;
  RectifiedPair pair;
  bool is_silent = false;  ///< a live source that gives no pictures at the moment; the frame is the last one
  uint64_t number = 0;     ///< another one for each frame
};

struct StageTime {
  std::string stage;
  double ms = 0;  ///< so far, for the last one
};

struct RunMark {
  int frame = 0;
  double time_s = 0;
  std::string text;
};

struct RunView {
  std::filesystem::path folder;
  int frame_count = -1;  ///< -1 = unknown
  bool over = false;
  std::string end;  ///< why it ended before the recording did; empty = it did not
  int passed_over = 0;
  int dropped = 0;  ///< frames of a live source in whose place a newer one was looked at
  std::vector<RunMark> marks;
  std::shared_ptr<const RowLog> rows;
  std::shared_ptr<const RunFrame> shown;  ///< the newest; nothing before the first
  int64_t shown_ns = 0;                   ///< steady clock, when its row was on the disk and its picture painted
};

/// What a session is at one moment; never changed once it is published.
struct Snapshot {
  uint64_t version = 0;
  Phase phase = Phase::idle;
  std::string sentence;  ///< failed: why
  std::filesystem::path scene_file;
  std::string scene_text;
  SceneFile scene;
  bool is_saved = true;
  bool can_undo = false, can_redo = false;
  std::shared_ptr<const SourceView> source;
  std::vector<StageTime> stages;  ///< of the build that goes on, or of the last one
  std::shared_ptr<const BuiltMap> map;
  uint64_t map_number = 0;    ///< another one for each map
  bool map_is_stale = false;  ///< the scene has changed since
  std::optional<RunView> run;
  bool may_open_live = false;    ///< devices, pipelines and addresses that no trusted scene names
  std::optional<KeptView> kept;  ///< of a live source, the last time
};
using SharedSnapshot = std::shared_ptr<const Snapshot>;

}  // namespace palpate
