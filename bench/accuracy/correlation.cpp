#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "app/run.h"
#include "app/runtime.h"
#include "bench/accuracy/sequences.h"
#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/estimate/force_estimator.h"

// Where the band of the force comes from: `bench_correlation [NAME ...]`, all static sequences without a name.
namespace {

using namespace palpate;
using namespace palpate::app;

constexpr double kLoadedRatio = 0.05;  // of the peak: frames that count

std::vector<ForceEstimate> loaded_frames(const SceneFile& file) {
  const BuiltMap built = build_map(file, true);
  ForceEstimator estimator(built.map, built.frame, built.rectification, file.scene.instrument, file.scene.contact,
                           file.scene.tuning);
  Recording recording(file.scene.recording);
  std::vector<ForceEstimate> estimates;
  double peak_N = 0;
  while (auto frame = recording.next()) {
    estimates.push_back(estimator.update(*frame));
    peak_N = std::max(peak_N, estimates.back().force_N.norm());
  }
  std::erase_if(estimates, [peak_N](const ForceEstimate& e) {
    return e.status != FrameStatus::ok || e.force_N.norm() < kLoadedRatio * peak_N;
  });
  return estimates;
}

void print_row(const std::string& name, const std::vector<ForceEstimate>& frames) {
  const auto of = [&frames](double ForceCorrelation::*member) {
    std::vector<double> values;
    for (const ForceEstimate& e : frames) values.push_back(e.correlation.*member);
    return median_of(values);
  };
  fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", name, frames.size(),
             of(&ForceCorrelation::scene_motion), of(&ForceCorrelation::disparity_bias), of(&ForceCorrelation::offset),
             of(&ForceCorrelation::radius), of(&ForceCorrelation::skew));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  choose_blas_core(argv);
  std::vector<std::string> names(argv + 1, argv + argc);
  if (names.empty()) names = static_sequences();
  const std::filesystem::path folder = "out/bench";
  fmt::print("| sequence | frames | scene's motion | disparity bias | offset | radius | skew |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (const std::string& name : names) try {
      const Sequence sequence = is_dejavu(name)
                                    ? rendered(name, dejavu_scene(name, 0), folder / "sequences" / (name + "_0"))
                                    : reference_sequence(name);
      const std::filesystem::path file = folder / "runs" / "correlation" / (name + ".yaml");
      save_scene(sequence.scene, file);
      print_row(name, loaded_frames(read_scene_file(file, true)));
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}: {}\n", name, error.what());
    }
}
