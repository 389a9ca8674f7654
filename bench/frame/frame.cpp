#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <thread>
#include <vector>

#include "app/run.h"
#include "app/runtime.h"
#include "bench/page.h"
#include "bench/runtime/machine_limits.h"
#include "palpate/core/errors.h"
#include "palpate/core/stopwatch.h"
#include "palpate/feedback/overlay.h"
#include "palpate/session/run.h"

// Where a frame's time goes: wall and processor time of each stage, over a sequence, beside what the machine can do.
namespace {

using namespace palpate;

const std::string kBegin = "<!-- table of bench_frame -->\n", kEnd = "<!-- end of the table -->";

double cpu_ms() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1e3 * static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-3 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

double at(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Stage {
  const char* name;
  std::vector<double> wall_ms;
};

struct Frames {
  std::vector<Stage> stages = {{"rectify, both cameras", {}},
                               {"instruments and tissue points", {}},
                               {"one estimate: hypotheses, equilibrium, band", {}},
                               {"stress", {}},
                               {"drawing", {}},
                               {"decoding, beside it", {}},
                               {"whole frame without decoding", {}}};
  std::vector<double> cpu_ms;
};

Frames run(SceneFile scene_file, const std::string& segmentation) {
  scene_file.scene.instrument.segmentation = segmentation;
  const BuiltMap built = app::build_map(scene_file, true);
  ForceEstimator estimator = make_estimator(scene_file, built);
  OverlayPainter painter(built.rectification, scene_file.scene.tissue, scene_file.overlay);
  Recording recording(scene_file.scene.recording);
  Frames frames;
  while (true) {
    Stopwatch decoding;
    const std::optional<StereoFrame> frame = recording.next();
    if (!frame) return frames;
    const double decode_ms = decoding.lap_ms(), before_ms = cpu_ms();
    const ForceEstimate estimate = estimator.update(*frame);
    Stopwatch drawing;
    painter.paint(frame->left, estimate);
    const double draw_ms = drawing.lap_ms();
    frames.cpu_ms.push_back(cpu_ms() - before_ms);
    const FrameTimes& t = estimate.times;
    const double each[] = {t.rectify_ms, t.track_ms, t.contact_ms + t.solve_ms,         t.stress_ms,
                           draw_ms,      decode_ms,  t.total_ms() - t.draw_ms + draw_ms};
    for (size_t i = 0; i < frames.stages.size(); ++i) frames.stages[i].wall_ms.push_back(each[i]);
  }
}

/// "frame 12: 191 ms, 178 of them for instruments and tissue points".
std::string slowest_of(const Frames& frames) {
  const std::vector<double>&whole = frames.stages.back().wall_ms, &track = frames.stages[1].wall_ms;
  std::vector<size_t> order(whole.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&whole](size_t a, size_t b) { return whole[a] > whole[b]; });
  std::string text;
  for (size_t k = 0; k < std::min<size_t>(4, order.size()); ++k)
    text += fmt::format("{}{} ({:.0f} ms, {:.0f} of them for instruments and tissue points)", k == 0 ? "" : ", ",
                        order[k], whole[order[k]], track[order[k]]);
  return text;
}

std::string table_of(const std::filesystem::path& scene) {
  const SceneFile scene_file = read_scene_file(scene, true);
  std::string table = fmt::format(
      "{}, {} cores: one thread does {:.0f} GFLOP/s (DGEMM) and {:.1f} GB/s (triad).\n\n"
      "| stage | colour: median / 99 % ms | learned: median / 99 % ms | goal ms |\n|---|---|---|---|\n",
      scene.parent_path().filename().string(), std::thread::hardware_concurrency(), bench::dgemm_GFLOP_per_s(),
      bench::triad_GB_per_s());
  const Frames colour = run(scene_file, "colour"), learned = run(scene_file, "learned");
  for (size_t i = 0; i < colour.stages.size(); ++i) {
    const auto &a = colour.stages[i], &b = learned.stages[i];
    const bool whole = i + 1 == colour.stages.size();
    table += fmt::format("| {} | {:.1f} / {:.1f} | {:.1f} / {:.1f} | {} |\n", a.name, at(a.wall_ms, 0.5),
                         at(a.wall_ms, 0.99), at(b.wall_ms, 0.5), at(b.wall_ms, 0.99),
                         whole    ? "10 / 20 (35 GFLOP/s and more: 20 / 35)"
                         : i == 4 ? "3"
                         : i == 1 ? "4"
                                  : "");
  }
  table += fmt::format("| processor time of a frame | {:.1f} / {:.1f} | {:.1f} / {:.1f} | |\n", at(colour.cpu_ms, 0.5),
                       at(colour.cpu_ms, 0.99), at(learned.cpu_ms, 0.5), at(learned.cpu_ms, 0.99));
  return table + "\nSlowest frames: " + slowest_of(learned) + ".\n";
}

}  // namespace

int main(int argc, char** argv) {
  app::choose_blas_core(argv);
  CLI::App program("Where a frame's time goes");
  std::filesystem::path scene, page;
  program.add_option("scene", scene, "scene.yaml of a recording")->required();
  program.add_option("--page", page, "page whose table is written anew");
  CLI11_PARSE(program, argc, argv);
  try {
    const std::string table = table_of(scene);
    fmt::print("{}", table);
    if (!page.empty()) bench::write_between(page, kBegin, kEnd, table);
  } catch (const BadInput& reason) {
    fmt::print(stderr, "bench_frame: {}\n", reason.what());
    return 3;
  }
  return 0;
}
