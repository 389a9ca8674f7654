#include "study/work.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>

#include "palpate/core/errors.h"
#include "palpate/feedback/sensor_log.h"
#include "study/files.h"

namespace palpate::study {

namespace {

/// Relative paths of a scene start at its file; a copy elsewhere has to say them in full.
void make_paths_absolute(YAML::Node scene, const std::filesystem::path& from) {
  const auto full = [&from](YAML::Node group, const char* key) {
    if (!group.IsMap() || !group[key] || !group[key].IsScalar()) return;
    const auto text = group[key].as<std::string>();
    if (text.find("${") == std::string::npos && text.find("://") == std::string::npos &&
        std::filesystem::path(text).is_relative() && std::filesystem::exists(from / text))
      group[key] = std::filesystem::absolute(from / text).string();
  };
  for (const char* key : {"left", "right", "stereo", "calibration"}) full(scene["recording"], key);
  full(scene["map"], "volume");
  full(scene["instrument"], "track");
}

YAML::Node merged(const YAML::Node& base, const YAML::Node& told) {
  if (!base.IsMap() || !told.IsMap()) return YAML::Clone(told);
  YAML::Node result = YAML::Clone(base);
  for (const auto& entry : told) {
    const auto key = entry.first.as<std::string>();
    result[key] = result[key] ? merged(YAML::Clone(result[key]), entry.second) : YAML::Clone(entry.second);
  }
  return result;
}

/// A recording that a scene finds by an environment variable may be missing on this machine: the first such path that
/// leads nowhere, in words; empty where all are there.
std::string missing_recording(const YAML::Node& scene) {
  const YAML::Node recording = scene["recording"];
  for (const char* key : {"left", "right", "stereo", "calibration"}) {
    if (!recording.IsMap() || !recording[key]) continue;
    const auto path = recording[key].as<std::string>();
    const size_t end = path.find('}');
    if (!path.starts_with("${") || end == std::string::npos) continue;
    const std::string name = path.substr(2, end - 2), rest = path.substr(end + 1);
    const char* folder = std::getenv(name.c_str());
    if (folder == nullptr) return fmt::format("the data is not here: {} is not set", name);
    if (!std::filesystem::exists(folder + rest))
      return fmt::format("the data is not here: {} names a folder without {}", name, rest.substr(rest.find('/') + 1));
  }
  return "";
}

/// As palpate compare --sensor; empty where there is no force to align.
nlohmann::ordered_json against_sensor(const std::filesystem::path& forces, const std::filesystem::path& log) {
  try {
    return nlohmann::ordered_json::parse(to_json(compare_with_log(read_forces(forces), log)));
  } catch (const BadInput&) {
    return nlohmann::ordered_json::object();
  }
}

/// Figures and status of the estimate of `place`/scene.yaml, or why there are none.
nlohmann::ordered_json estimated(const YAML::Node& scene, const std::filesystem::path& place,
                                 const std::filesystem::path& truth, const Estimate& estimate) {
  if (const std::string missing = missing_recording(scene); !missing.empty())
    return {{"status", "skipped"}, {"reason", missing}};
  try {
    auto result = estimate(place / "scene.yaml", place, truth);
    result["status"] = "done";
    if (const auto log = truth.parent_path() / "sensor.csv"; !truth.empty() && std::filesystem::exists(log))
      result["sensor"] = against_sensor(place / "forces.csv", log);
    return result;
  } catch (const BadInput& error) {
    return {{"status", "failed"}, {"reason", error.what()}};
  }
}

/// What a run is told, to be recognised by.
std::string told_text(const Run& run) {
  return YAML::Dump(run.scene) + "\n# sequence " + run.sequence + "\n";
}

}  // namespace

std::filesystem::path sequence_folder(const std::string& sequence, const std::filesystem::path& folder) {
  return folder / "sequences" / sequence;
}

std::filesystem::path run_folder(const Run& run, const std::filesystem::path& folder) {
  return folder / "runs" / run.name;
}

bool sequence_is_there(const Sequence& sequence, const std::filesystem::path& folder) {
  return std::filesystem::exists(sequence_folder(sequence.name, folder) / kSequenceDone);
}

void make_sequence(const Sequence& sequence, const Study& study, const std::filesystem::path& folder,
                   const Simulate& simulate) {
  if (sequence_is_there(sequence, folder)) return;
  const std::filesystem::path place = sequence_folder(sequence.name, folder);
  std::filesystem::create_directories(place);
  YAML::Node scene = YAML::Clone(sequence.scene);
  YAML::Node body = scene["simulate"]["body"];
  if (body.IsMap() && body["shape"] &&
      std::filesystem::exists(study.file.parent_path() / body["shape"].as<std::string>()))
    body["shape"] = std::filesystem::absolute(study.file.parent_path() / body["shape"].as<std::string>()).string();
  write_file(place / "simulate.yaml", YAML::Dump(scene) + "\n");
  simulate(place / "simulate.yaml", place);
  write_file(place / kSequenceDone, "");
}

void make_run(const Run& run, const std::filesystem::path& folder, const Estimate& estimate) {
  const std::filesystem::path place = run_folder(run, folder);
  std::filesystem::create_directories(place);
  YAML::Node scene = YAML::Clone(run.scene);
  std::filesystem::path truth;
  if (run.sequence.empty()) {
    make_paths_absolute(scene, run.scene_file.parent_path());
  } else {
    const std::filesystem::path sequence = sequence_folder(run.sequence, folder);
    YAML::Node base = YAML::LoadFile((sequence / "scene.yaml").string());
    scene = merged(base, scene);
    make_paths_absolute(scene, sequence);
    truth = sequence / "truth.csv";
  }
  write_file(place / "scene.yaml", YAML::Dump(scene) + "\n");
  nlohmann::ordered_json result = estimated(scene, place, truth, estimate);
  result["told"] = told_text(run);
  write_file(place / kRunResult, result.dump(2) + "\n");
}

nlohmann::ordered_json result_of(const Run& run, const std::filesystem::path& folder) {
  std::ifstream stream(run_folder(run, folder) / kRunResult);
  if (!stream) return nullptr;
  auto result = nlohmann::ordered_json::parse(stream, nullptr, false);
  if (result.is_discarded() || result.value("told", "") != told_text(run)) return nullptr;
  return result;
}

}  // namespace palpate::study
