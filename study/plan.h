#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace palpate::study {

/// One setting of a sweep.
struct Value {
  std::string label;
  YAML::Node value;
  std::optional<double> number;  ///< where the value is one: its place on the chart
};

/// A scene that is simulated (or a recording), and how it is estimated: once, or for each value of one key.
struct Experiment {
  std::string name, title, paper, says, why, unit;
  std::filesystem::path scene;  ///< empty where the values are scenes
  YAML::Node set;               ///< dotted keys of the scene file and their values: for the sequence and the estimate
  YAML::Node estimate;          ///< the same, told to the estimate alone
  std::string key;              ///< what is swept; "scene" = the scene files themselves; empty = one run
  std::vector<Value> values;
  bool logarithmic = false;             ///< axis of the sweep
  std::optional<double> uncertainty;    ///< how wrong one is in practice: in its unit, on a logarithmic axis a factor
  std::optional<double> known;          ///< what the scene says of the key
  std::map<std::string, double> goals;  ///< figure -> at most this magnitude
  std::optional<std::string> expects_warning;
};

struct Study {
  std::filesystem::path file;
  std::string title, about;
  std::vector<Experiment> experiments;
};

/// One sequence with known force, made once for all the runs that ask for it.
struct Sequence {
  std::string name;
  YAML::Node scene;
};

/// One estimate: a command line of its own.
struct Run {
  std::string name;  ///< experiment/label, unique
  const Experiment* experiment = nullptr;
  const Value* value = nullptr;  ///< null where nothing is swept
  std::filesystem::path scene_file;
  std::string sequence;  ///< empty: the scene names a recording
  YAML::Node scene;      ///< what the estimate is told beyond the scene of the sequence (all, without one)
};

struct Plan {
  std::vector<Sequence> sequences;
  std::vector<Run> runs;
};

/// Throws BadInput that names the file, the key, the value and what was expected. `quick`: of each sweep only as many
/// values as its `quick` says, evenly; experiments with `quick: 0` are left out.
Study read_study(const std::filesystem::path& file, bool quick);

/// What has to be done. A swept key below `simulate` changes the sequence; any other is told to the estimate alone,
/// while the sequence stays as it is.
Plan plan_of(const Study& study);

}  // namespace palpate::study
