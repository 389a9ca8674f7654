#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "app/runtime.h"
#include "bench/accuracy/measured.h"
#include "bench/accuracy/random_scenes.h"
#include "palpate/core/errors.h"

// The random scenes: pixels in, newtons out, one row per scene and the closing figures. Recordings are made once.
namespace {

using namespace palpate;

constexpr int kAttempts = 5;            // to draw a scene that can be made
constexpr double kGoalPct = 10;         // of most scenes
constexpr double kGoalFraction = 0.95;  // of the scenes
constexpr double kWorstPct = 20;        // of the others, unless flagged

Sequence rendered_scene(int number, const std::filesystem::path& folder) {
  const std::string name = fmt::format("{:02d}", number);
  // One that stands there, whatever attempt it was.
  for (int attempt = 0; attempt < kAttempts; ++attempt)
    if (is_rendered(dejavu_text(random_scene(number, attempt)), folder / name))
      return rendered(name, dejavu_text(random_scene(number, attempt)), folder / name);
  for (int attempt = 0; attempt < kAttempts; ++attempt) try {
      return rendered(name, dejavu_text(random_scene(number, attempt)), folder / name);
    } catch (const BadInput& error) {
      fmt::print(stderr, "scene {} is drawn again: {}\n", number, error.what());
    }
  throw Unfinished(fmt::format("scene {}: no attempt could be made", number));
}

struct Scored {
  int number;
  std::string what;
  std::optional<Measured> measured;  // empty: the run failed
};

double nrmse(const Scored& scored) {
  return scored.measured ? scored.measured->figures.force_nrmse_pct.value_or(100) : 100;
}

void print_row(const Scored& scored) {
  if (!scored.measured) {
    fmt::print("| {} | {} | failed | | | | | | | | | |\n", scored.number, scored.what);
    return;
  }
  const Measured& m = *scored.measured;
  const Comparison& c = m.figures;
  fmt::print("| {} | {} | {} | {} | {} | {} / {} | {} | {} | {} | {} / {} | {} | {} |\n", scored.number, scored.what,
             or_dash(c.force_nrmse_pct, 1), or_dash(c.gain, 2), or_dash(c.direction_error_deg_median, 1),
             or_dash(c.onset_error_frames), or_dash(c.release_error_frames), c.false_contact_frames,
             c.missed_force_frames, c.reversed_ok_frames, or_dash(c.band_coverage_pct, 0),
             or_dash(c.band_half_width_pct, 1), statuses_text(m), m.flagged ? "yes" : "");
  std::fflush(stdout);
}

void print_summary(const std::vector<Scored>& all) {
  const auto good = std::count_if(all.begin(), all.end(), [](const Scored& s) { return nrmse(s) <= kGoalPct; });
  const auto bad = std::count_if(all.begin(), all.end(), [](const Scored& s) {
    return nrmse(s) > kWorstPct && !(s.measured && s.measured->flagged);
  });
  std::vector<double> errors;
  double covered = 0, width = 0;
  int loaded = 0, reversed = 0, missed = 0;
  for (const Scored& s : all) {
    errors.push_back(nrmse(s));
    if (!s.measured) continue;
    reversed += s.measured->figures.reversed_ok_frames;
    missed += s.measured->figures.missed_force_frames;
    if (!s.measured->figures.band_coverage_pct) continue;
    loaded += s.measured->loaded_frames;
    covered += s.measured->loaded_frames * *s.measured->figures.band_coverage_pct;
    width += s.measured->loaded_frames * *s.measured->figures.band_half_width_pct;
  }
  const auto worst =
      std::max_element(all.begin(), all.end(), [](const Scored& a, const Scored& b) { return nrmse(a) < nrmse(b); });
  fmt::print("\n{} of {} scenes at most {:g} % ({:.0f} %; goal {:.0f} %); median {:.1f} %\n", good, all.size(),
             kGoalPct, 100.0 * static_cast<double>(good) / static_cast<double>(all.size()), 100 * kGoalFraction,
             spread(errors).median);
  fmt::print("worst: scene {} with {:.1f} %{}; {} scenes above {:g} % and not flagged (goal 0)\n", worst->number,
             nrmse(*worst), worst->measured && worst->measured->flagged ? ", flagged" : "", bad, kWorstPct);
  fmt::print("frames that are ok and more than 90 degrees off: {}; missed from the third of a contact on: {}\n",
             reversed, missed);
  if (loaded > 0)
    fmt::print(
        "band: {:.1f} % of all frames with a force (goal 90-98), mean half width {:.1f} % of the peak (goal <= 12)\n",
        covered / loaded, width / loaded);
}

}  // namespace

int main(int argc, char** argv) {
  app::choose_blas_core(argv);
  CLI::App arguments("Random scenes with known force: rendered once, estimated, one row each");
  int first = 1, last = 20;
  std::filesystem::path folder = "out/bench";
  std::string drive;
  bool only_render = false;
  arguments.add_option("first", first, "number of the first scene (1-20: for work; 21-40: for the closing table)")
      ->check(CLI::Range(1, 999))
      ->capture_default_str();
  arguments.add_option("last", last, "number of the last one")->check(CLI::Range(1, 999))->capture_default_str();
  arguments.add_option("-o,--output", folder, "recordings and results")->capture_default_str();
  arguments.add_option("--drive", drive, "contact.drive of the estimate");
  arguments.add_flag("--render", only_render, "make the recordings only");
  CLI11_PARSE(arguments, argc, argv);
  try {
    std::vector<Scored> all;
    if (!only_render)
      fmt::print(
          "| scene | what | force NRMSE % | gain | direction deg | onset / release frames | false contact | missed | "
          "ok and reversed | band % / half width % | frames | flagged "
          "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (int number = first; number <= last; ++number) {
      const Sequence sequence = rendered_scene(number, folder / "scenes");
      if (only_render) continue;
      std::vector<SceneChange> changes;
      if (!drive.empty()) changes.push_back({"contact.drive", YAML::Node(drive)});
      const std::filesystem::path results =
          folder / "runs" / fmt::format("scene_{:02d}{}{}", number, drive.empty() ? "" : "_", drive);
      all.push_back({number,
                     describe_random_scene(read_scene_file(folder / "scenes" / sequence.name / "made_of.yaml", false)),
                     measure(sequence, changes, results)});
      print_row(all.back());
    }
    if (!all.empty()) print_summary(all);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 4;
  }
}
