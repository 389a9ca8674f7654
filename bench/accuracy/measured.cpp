#include "bench/accuracy/measured.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "palpate/core/errors.h"
#include "palpate/feedback/forces_file.h"

namespace palpate {
namespace {

constexpr double kLoadedFraction = 0.05;  // of the true peak: frames that are judged
constexpr double kFlaggedFraction = 0.5;  // of them

/// Counts the frames with a force, and whether more than half of them are flagged.
void judge_frames(const std::filesystem::path& forces, const std::filesystem::path& truth_file, Measured& measured) {
  std::map<int, ForceRow> by_frame;
  for (const ForceRow& row : read_forces(forces)) by_frame[row.frame] = row;
  int flagged = 0;
  for (const ForceRow& row : read_truth(truth_file)) {
    if (!(row.force_magnitude_N > kLoadedFraction * measured.figures.true_peak_N)) continue;
    ++measured.loaded_frames;
    const auto found = by_frame.find(row.frame);
    if (found == by_frame.end()) continue;
    const ForceRow& e = found->second;
    const bool in_band =
        e.has_band() && e.force_low_N <= row.force_magnitude_N && row.force_magnitude_N <= e.force_high_N;
    flagged += e.status != "ok" || in_band;
  }
  measured.flagged = flagged > kFlaggedFraction * measured.loaded_frames;
}

}  // namespace

std::optional<Measured> measure(const Sequence& sequence, const std::vector<SceneChange>& changes,
                                const std::filesystem::path& folder) {
  try {
    save_scene(changed(sequence.scene, changes), folder / "scene.yaml");
    const app::RunSummary summary =
        app::run_estimate(read_scene_file(folder / "scene.yaml", true), {folder, sequence.truth, true});
    Measured measured;
    measured.figures = summary.comparison.value();
    measured.second = summary.comparison_2;
    measured.frames_by_status = summary.frames_by_status;
    measured.frames = summary.frames;
    measured.elements = summary.elements;
    measured.median_frame_ms = summary.median_frame_ms;
    measured.p99_frame_ms = summary.p99_frame_ms;
    judge_frames(folder / "forces.csv", sequence.truth, measured);
    return measured;
  } catch (const BadInput& error) {
    fmt::print(stderr, "{}: {}\n", folder.string(), error.what());
  } catch (const Unfinished& error) {
    fmt::print(stderr, "{}: {}\n", folder.string(), error.what());
  }
  return std::nullopt;
}

double false_force_pct(const Comparison& figures) {
  return figures.true_peak_N > 0 ? 100 * figures.false_force_max_N / figures.true_peak_N : 0;
}

std::string or_dash(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::string or_dash(const std::optional<int>& value) {
  return value ? fmt::format("{:+d}", *value) : "-";
}

std::string statuses_text(const Measured& measured) {
  std::string text;
  for (const auto& [status, count] : measured.frames_by_status)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, status);
  return text;
}

Spread spread(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return {values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]), values.back()};
}

}  // namespace palpate
