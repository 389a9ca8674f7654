#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "palpate/feedback/compare.h"
#include "palpate/session/built_map.h"
#include "palpate/session/scene_file.h"

namespace palpate::app {

struct RunOptions {
  std::filesystem::path folder;
  std::filesystem::path truth;  ///< empty = none; truth_2.csv beside it is that of a second instrument
  bool quiet = false;           ///< no progress, no sentences
  bool realtime = false;        ///< the recording at its own rate; frames whose time is over are passed over
};

/// Figures of one run, for people and machines.
struct RunSummary {
  std::filesystem::path folder;  ///< where the results are
  TissueOptions tissue;
  int frames = 0;
  std::optional<int> dropped;  ///< of a live source: frames in whose place a newer one was looked at
  int elements = 0;
  double map_s = 0;
  double median_frame_ms = 0;
  double p99_frame_ms = 0;
  FrameTimes stages;  ///< median of each, of the frames in contact where there are any
  double peak_force_N = 0;
  Vec3 peak_force_per_modulus_N_per_kPa = Vec3::Zero();  ///< with its 95 % band from the images: value, low, high
  std::map<std::string, int> frames_by_status;
  std::map<std::string, int> frames_by_warning;
  std::optional<Comparison> comparison;
  std::optional<double> peak_force_2_N;  ///< of a second instrument, where one came into view
  std::optional<Comparison> comparison_2;
  std::vector<std::string> streams;  ///< what was sent, a line for each stream
};

/// Tells people on standard error what a build finds on the way.
BuildWatch watch_of_terminal(bool quiet);

/// The build stage of a scene; what is found on the way goes to standard error. Throws BadInput, Unfinished.
BuiltMap build_map(const SceneFile& scene_file, bool quiet);

/// Both stages of a scene, with every file of the contract. Nothing is written before the map stands. Throws BadInput;
/// throws Unfinished when the recording ends early or spoils on the way or the user interrupts, with all rows and
/// pictures so far on the disk.
RunSummary run_estimate(const SceneFile& scene_file, const RunOptions& options);

/// Both stages of a scene; the rows of forces.csv, nothing is written. Throws BadInput, Unfinished.
std::vector<ForceRow> estimate_rows(const SceneFile& scene_file, bool quiet);

/// Lines of name and value.
std::string to_text(const RunSummary& summary);
nlohmann::ordered_json to_json(const RunSummary& summary);

}  // namespace palpate::app
