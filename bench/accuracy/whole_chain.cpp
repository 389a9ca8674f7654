#include <fmt/format.h>

#include <cstdlib>

#include "app/run.h"
#include "app/runtime.h"
#include "app/simulation.h"
#include "bench/accuracy/error_budget.h"
#include "palpate/core/mesh_files.h"
#include "palpate/simulate/organ_shape.h"

// Pixels in, newtons out, on every sequence with truth that this machine has: the table of README.md, and below it
// where the error comes from. `bench_accuracy FOLDER [NAME]` runs the sequences whose name holds NAME; recordings that
// lie in FOLDER already are used again.
namespace {

using namespace palpate;
using namespace palpate::app;

constexpr int kTrueBodyTriangles = 20000;

struct Case {
  std::string name;
  SceneFile scene;
  SceneFile scene_with_volume;
  std::filesystem::path truth;
};

std::string or_dash(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::string or_dash(const std::optional<int>& value) {
  return value ? fmt::format("{:+d}", *value) : "-";
}

Case simulated_case(const std::string& name, const SceneFile& scene, const std::filesystem::path& folder) {
  const std::filesystem::path recording = folder / (name + "_recording");
  Case c{name, {}, {}, recording / "truth.csv"};
  DejaVuSummary simulated;
  if (std::filesystem::exists(recording / "scene.yaml"))
    c.scene = read_scene_file(recording / "scene.yaml", true);
  else
    c.scene = simulate_into(scene, recording, false, simulated);
  c.scene_with_volume = c.scene;
  c.scene_with_volume.scene.map.volume = recording / "organ.ply";
  write_ply(c.scene_with_volume.scene.map.volume, make_organ(scene.simulate.body, kTrueBodyTriangles));
  return c;
}

RunSummary run_quietly(const SceneFile& scene, const Case& c, const std::filesystem::path& folder) {
  return run_estimate(scene, {folder, c.truth, true});
}

void print_row(const std::string& name, const RunSummary& summary) {
  const Comparison& figures = *summary.comparison;
  const auto not_converged = summary.frames_by_status.find("not_converged");
  fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.1f} / {:.1f} |\n", name, summary.elements,
             or_dash(figures.force_nrmse_pct, 1), or_dash(figures.gain, 2),
             or_dash(figures.direction_error_deg_median, 1), or_dash(figures.onset_error_frames),
             or_dash(figures.release_error_frames), figures.false_contact_frames, or_dash(figures.tip_rmse_mm, 2),
             not_converged == summary.frames_by_status.end() ? 0 : not_converged->second, summary.median_frame_ms,
             summary.p99_frame_ms);
  std::fflush(stdout);
}

/// One line of the error budget: how far the tip is off, and the force with the true tip, the true volume and both.
std::string budget_row(const Case& c, const RunSummary& as_is, const RunSummary& with_volume,
                       const std::filesystem::path& folder) {
  const std::vector<ForceRow> truth = read_truth(c.truth);
  const TipFigures tip = tip_figures(read_forces(as_is.folder / "forces.csv"), truth, read_visible(c.truth));
  const std::filesystem::path track = folder / (c.name + "_true_tip.csv");
  write_true_track(truth, track);
  const auto with_true_tip = [&](SceneFile scene, const std::string& name) {
    scene.scene.instrument.track = track;
    return run_quietly(scene, c, folder / name);
  };
  const auto nrmse = [](const RunSummary& summary) { return or_dash(summary.comparison->force_nrmse_pct, 1); };
  return fmt::format("| {} | {:.2f} / {:.2f} | {:.2f} | {:.3f} / {:.3f} | {:.1f} | {} | {} | {} | {} |\n", c.name,
                     tip.tip.lateral_mm, tip.tip.depth_mm, tip.worst_tip_mm, tip.since_onset.lateral_mm,
                     tip.since_onset.depth_mm, 100 * tip.seen_right_share, nrmse(as_is),
                     nrmse(with_true_tip(c.scene, c.name + "_true_tip")), nrmse(with_volume),
                     nrmse(with_true_tip(c.scene_with_volume, c.name + "_true_both")));
}

std::vector<Case> cases_with_truth(const std::filesystem::path& folder, const std::string& wanted) {
  std::vector<Case> cases;
  const auto is_wanted = [&wanted](const std::string& name) { return name.find(wanted) != std::string::npos; };
  if (is_wanted("dejavu_demo")) cases.push_back(simulated_case("dejavu_demo", demo_scene(), folder));
  for (const char* study : {"uterus", "liver_slab", "heart"}) {
    const std::filesystem::path file =
        std::filesystem::path(PALPATE_SOURCE_DIR) / "studies" / fmt::format("{}.yaml", study);
    const std::string name = fmt::format("dejavu_{}", study);
    if (is_wanted(name)) cases.push_back(simulated_case(name, read_scene_file(file, false), folder));
  }
  const char* reference = std::getenv("PALPATE_REFERENCE_DATA");
  for (const char* sequence : {"rendered_uterus", "rendered_liver"}) {
    if (!is_wanted(sequence)) continue;
    const std::filesystem::path data = std::filesystem::path(reference ? reference : "") / sequence;
    if (reference && std::filesystem::exists(data / "truth.csv"))
      cases.push_back({sequence, read_scene_file(data / "scene.yaml", true),
                       read_scene_file(data / "scene_volume.yaml", true), data / "truth.csv"});
    else
      fmt::print(stderr, "{}: reference data missing (set PALPATE_REFERENCE_DATA), left out\n", sequence);
  }
  return cases;
}

}  // namespace

int main(int argc, char** argv) {
  choose_blas_core(argv);
  const std::filesystem::path folder = argc > 1 ? argv[1] : "out/bench";
  const std::vector<Case> cases = cases_with_truth(folder, argc > 2 ? argv[2] : "");

  fmt::print(
      "| sequence | elements | force NRMSE % | gain | direction deg | onset frames | release frames | false contact "
      "frames | tip RMSE mm | not converged | frame ms median / p99 "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  fmt::print("| goal | | <= 10 (volume: 5) | 1 | <= 10 | within 2 | within 2 | 0 | <= 0.5 | 0 | <= 15 / 25 |\n");
  std::string budget;
  for (const Case& c : cases) {
    const RunSummary as_is = run_quietly(c.scene, c, folder / c.name);
    print_row(c.name, as_is);
    const RunSummary with_volume = run_quietly(c.scene_with_volume, c, folder / (c.name + "_volume"));
    print_row(c.name + ", true volume", with_volume);
    budget += budget_row(c, as_is, with_volume, folder);
  }
  fmt::print(
      "\nWhere it comes from: the tip (across / along the viewing ray), and the force NRMSE with the true tip, the "
      "true "
      "volume, both.\n\n"
      "| sequence | tip mm | worst frame mm | displacement since onset mm | seen right % | NRMSE % | true tip | true "
      "volume | both |\n|---|---|---|---|---|---|---|---|---|\n"
      "| goal | <= 0.5 together | <= 1.5 | <= 0.15 together | >= 99 | <= 10 | | <= 5 | |\n{}",
      budget);
  return 0;
}
