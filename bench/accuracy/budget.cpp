#include <fmt/format.h>

#include <cstdio>

#include "app/runtime.h"
#include "bench/accuracy/error_budget.h"
#include "bench/accuracy/measured.h"
#include "palpate/core/mesh_files.h"
#include "palpate/simulate/organ_shape.h"

// Where the error of the static sequences comes from: `bench_budget [NAME]` runs those whose name holds NAME.
namespace {

using namespace palpate;
using namespace palpate::app;

constexpr int kTrueBodyTriangles = 20000;

struct Case {
  std::string name;
  Sequence sequence;
  std::vector<SceneChange> with_volume;  ///< what tells the estimator the true volume
};

Case case_of(const std::string& name, const std::filesystem::path& folder) {
  if (!is_dejavu(name)) {
    const Sequence sequence = reference_sequence(name);
    const YAML::Node volume = value_at(load_scene(sequence.truth.parent_path() / "scene_volume.yaml"), "map");
    return {name, sequence, {{"map", volume}}};
  }
  const YAML::Node scene = dejavu_scene(name, 0);
  const std::filesystem::path recording = folder / "sequences" / (name + "_0");
  const Sequence sequence = rendered(name, scene, recording);
  const std::filesystem::path organ = std::filesystem::absolute(recording / "organ.ply");
  write_ply(organ, make_organ(read_scene_file(recording / "made_of.yaml", false).simulate.body, kTrueBodyTriangles));
  return {name, sequence, {{"map.volume", YAML::Node(organ.string())}}};
}

void print_row(const std::string& name, const Measured& measured) {
  const Comparison& figures = measured.figures;
  const auto not_converged = measured.frames_by_status.find("not_converged");
  fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.1f} / {:.1f} |\n", name, measured.elements,
             or_dash(figures.force_nrmse_pct, 1), or_dash(figures.gain, 2),
             or_dash(figures.direction_error_deg_median, 1), or_dash(figures.onset_error_frames),
             or_dash(figures.release_error_frames), figures.false_contact_frames, or_dash(figures.tip_rmse_mm, 2),
             not_converged == measured.frames_by_status.end() ? 0 : not_converged->second, measured.median_frame_ms,
             measured.p99_frame_ms);
  std::fflush(stdout);
}

std::string nrmse(const std::optional<Measured>& measured) {
  return measured ? or_dash(measured->figures.force_nrmse_pct, 1) : "failed";
}

/// One line of the error budget: how far the tip is off, and the force with the true tip, the true volume and both.
std::string budget_row(const Case& c, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::vector<ForceRow> truth = read_truth(c.sequence.truth);
  const std::filesystem::path track = std::filesystem::absolute(folder / (c.name + "_true_tip.csv"));
  write_true_track(truth, track);
  const SceneChange true_tip{"instrument.track", YAML::Node(track.string())};
  std::vector<SceneChange> both = c.with_volume;
  both.push_back(true_tip);
  const auto as_is = measure(c.sequence, {}, folder / c.name);
  const auto with_volume = measure(c.sequence, c.with_volume, folder / (c.name + "_volume"));
  if (!as_is) return fmt::format("| {} | failed | | | | | | | |\n", c.name);
  print_row(c.name, *as_is);
  if (with_volume) print_row(c.name + ", true volume", *with_volume);
  const TipFigures tip =
      tip_figures(read_forces(folder / c.name / "forces.csv"), truth, read_visible(c.sequence.truth));
  return fmt::format("| {} | {:.2f} / {:.2f} | {:.2f} | {:.3f} / {:.3f} | {:.1f} | {} | {} | {} | {} |\n", c.name,
                     tip.tip.lateral_mm, tip.tip.depth_mm, tip.worst_tip_mm, tip.since_onset.lateral_mm,
                     tip.since_onset.depth_mm, 100 * tip.seen_right_fraction, nrmse(as_is),
                     nrmse(measure(c.sequence, {true_tip}, folder / (c.name + "_true_tip"))), nrmse(with_volume),
                     nrmse(measure(c.sequence, both, folder / (c.name + "_true_both"))));
}

}  // namespace

int main(int argc, char** argv) {
  choose_blas_core(argv);
  const std::filesystem::path folder = "out/bench";
  const std::string wanted = argc > 1 ? argv[1] : "";
  fmt::print(
      "| sequence | elements | force NRMSE % | gain | direction deg | onset frames | release frames | false contact "
      "frames | tip RMSE mm | not converged | frame ms median / p99 "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  std::string budget;
  for (const std::string& name : static_sequences()) try {
      if (name.find(wanted) != std::string::npos)
        budget += budget_row(case_of(name, folder), folder / "runs" / "budget");
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
    }
  fmt::print(
      "\nWhere it comes from: the tip (across / along the viewing ray), and the force NRMSE with the true tip, the "
      "true "
      "volume, both.\n\n"
      "| sequence | tip mm | worst frame mm | displacement since onset mm | seen right % | NRMSE % | true tip | true "
      "volume | both |\n|---|---|---|---|---|---|---|---|---|\n{}",
      budget);
  return 0;
}
