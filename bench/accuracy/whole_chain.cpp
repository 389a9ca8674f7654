#include <fmt/format.h>

#include <cstdlib>

#include "app/run.h"
#include "app/runtime.h"
#include "app/simulation.h"

// Pixels in, newtons out, on every sequence with truth that this machine has: the table of README.md.
namespace {

using namespace palpate;
using namespace palpate::app;

struct Case {
  std::string name;
  std::filesystem::path scene;
  std::filesystem::path truth;
};

std::string or_dash(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::string or_dash(const std::optional<int>& value) {
  return value ? fmt::format("{:+d}", *value) : "-";
}

Case simulated_case(const std::string& name, const SceneFile& scene, const std::filesystem::path& folder) {
  DejaVuSummary simulated;
  const std::filesystem::path recording = folder / (name + "_recording");
  simulate_into(scene, recording, false, simulated);
  return {name, recording / "scene.yaml", recording / "truth.csv"};
}

void print_row(const Case& c, const std::filesystem::path& folder) {
  const RunSummary summary = run_estimate(read_scene_file(c.scene, true), {folder / c.name, c.truth, true});
  const Comparison& figures = *summary.comparison;
  const auto share_ok = [&summary](const char* status) {
    const auto found = summary.frames_by_status.find(status);
    return found == summary.frames_by_status.end() ? 0 : found->second;
  };
  fmt::print("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.1f} / {:.1f} |\n", c.name, summary.elements,
             or_dash(figures.force_nrmse_pct, 1), or_dash(figures.gain, 2),
             or_dash(figures.direction_error_deg_median, 1), or_dash(figures.onset_error_frames),
             or_dash(figures.release_error_frames), figures.false_contact_frames, or_dash(figures.tip_rmse_mm, 2),
             share_ok("not_converged"), summary.median_frame_ms, summary.p99_frame_ms);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  choose_blas_core(argv);
  const std::filesystem::path folder = argc > 1 ? argv[1] : "out/bench";
  const char* reference = std::getenv("PALPATE_REFERENCE_DATA");
  std::vector<Case> cases;

  cases.push_back(simulated_case("dejavu_demo", demo_scene(), folder));
  for (const char* study : {"uterus", "liver_slab", "heart"})
    cases.push_back(simulated_case(
        fmt::format("dejavu_{}", study),
        read_scene_file(std::filesystem::path(PALPATE_SOURCE_DIR) / "studies" / fmt::format("{}.yaml", study), false),
        folder));
  for (const char* sequence : {"rendered_uterus", "rendered_liver"})
    for (const char* scene : {"scene", "scene_volume"}) {
      const std::filesystem::path data = std::filesystem::path(reference ? reference : "") / sequence;
      if (reference && std::filesystem::exists(data / "truth.csv"))
        cases.push_back(
            {fmt::format("{}_{}", sequence, scene), data / fmt::format("{}.yaml", scene), data / "truth.csv"});
      else
        fmt::print(stderr, "{}: reference data missing (set PALPATE_REFERENCE_DATA), left out\n", sequence);
    }

  fmt::print(
      "| sequence | elements | force NRMSE % | gain | direction deg | onset frames | release frames | false contact "
      "frames | tip RMSE mm | not converged | frame ms median / p99 "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  fmt::print("| goal | | <= 25 | 1 | | within 5 | | 0 | <= 2 | 0 | |\n");
  for (const Case& c : cases) print_row(c, folder);
  return 0;
}
