#include <fmt/format.h>

#include <cstdlib>

#include "app/run.h"
#include "app/runtime.h"
#include "app/simulation.h"
#include "palpate/simulate/uterus_demo.h"

// Pixels in, newtons out, on every sequence with truth that this machine has: the table of docs/results.md.
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

  SceneFile demo;
  const SimulatedCase uterus = uterus_demo();
  demo.simulate = uterus.simulate;
  demo.has_simulate = true;
  demo.scene.tissue = uterus.tissue;
  demo.scene.attachments = uterus.attachments;
  demo.scene.contact = uterus.contact;
  demo.scene.map.elements = 550;
  DejaVuSummary simulated;
  simulate_into(demo, folder / "recording", false, simulated);
  cases.push_back({"dejavu_uterus", folder / "recording/scene.yaml", folder / "recording/truth.csv"});
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
