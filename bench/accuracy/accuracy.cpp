#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "app/runtime.h"
#include "bench/accuracy/checks.h"
#include "bench/accuracy/measured.h"
#include "palpate/core/errors.h"

// What must hold, pixels in and newtons out: one row per check and sequence, both drives side by side, the goal beside
// what is measured. Recordings are made once.
namespace {

using namespace palpate;

struct Arguments {
  std::vector<std::string> names;  // of checks, sequences or "check/sequence"; empty = all
  int seeds = 3;
  std::filesystem::path folder = "out/bench";
};

/// The same estimate over all seeds.
struct Row {
  std::vector<Measured> measured;
  int failed = 0;

  std::vector<double> all(const std::function<double(const Measured&)>& figure) const {
    std::vector<double> values;
    for (const Measured& m : measured) values.push_back(figure(m));
    return values;
  }
  Spread nrmse() const {
    std::vector<double> values = all([](const Measured& m) { return m.figures.force_nrmse_pct.value_or(100); });
    values.insert(values.end(), static_cast<size_t>(failed), 100);
    return spread(values);
  }
  /// Of a second instrument; 0 where there is none.
  double second_pct() const {
    return spread(all([](const Measured& m) { return m.second ? m.second->force_nrmse_pct.value_or(100) : 0; })).worst;
  }
  Spread direction_deg() const {
    return spread(all([](const Measured& m) { return m.figures.direction_error_deg_median.value_or(180); }));
  }
  double median_gain() const {
    return spread(all([](const Measured& m) { return m.figures.gain.value_or(0); })).median;
  }
  double worst_between_pct() const {
    return spread(all([](const Measured& m) { return false_force_pct(m.figures); })).worst;
  }
  /// The largest in magnitude, with its sign.
  std::string worst(const std::function<std::optional<int>(const Measured&)>& figure) const {
    std::optional<int> found;
    for (const Measured& m : measured) {
      const std::optional<int> value = figure(m);
      if (!value) return "-";
      if (!found || std::abs(*value) > std::abs(*found)) found = value;
    }
    return or_dash(found);
  }
  int max(const std::function<int(const Measured&)>& figure) const {
    int found = 0;
    for (const Measured& m : measured) found = std::max(found, figure(m));
    return found;
  }
  bool flagged() const {
    return std::all_of(measured.begin(), measured.end(), [](const Measured& m) { return m.flagged; });
  }
};

bool holds(const Goal& goal, const Row& row, const std::optional<Row>& tip) {
  if (row.measured.empty() || row.failed > 0) return false;
  if (goal.no_worse_than_tip) return row.flagged() || !tip || row.nrmse().median <= tip->nrmse().median;
  if (row.nrmse().median > goal.median_pct || row.nrmse().worst > goal.worst_pct) return false;
  if (row.second_pct() > goal.worst_pct) return false;
  if (goal.shape && (std::abs(row.median_gain() - 1) > 0.05 || row.direction_deg().median > 5)) return false;
  return !goal.between || row.worst_between_pct() <= 3;
}

std::string band_text(const Row& row) {
  std::vector<double> covered, width;
  for (const Measured& m : row.measured) {
    if (!m.figures.band_coverage_pct) return "-";
    covered.push_back(*m.figures.band_coverage_pct);
    width.push_back(*m.figures.band_half_width_pct);
  }
  return fmt::format("{:.0f} / {:.1f}", spread(covered).median, spread(width).median);
}

void print_row(const std::string& name, const std::string& drive, const Goal& goal, const Row& row,
               const std::optional<Row>& tip) {
  if (row.measured.empty()) {
    fmt::print("| {} | {} | {} | failed | | | | | | | | | | |\n", name, drive, goal.text());
    return;
  }
  const std::string second = row.second_pct() > 0 ? fmt::format(" (second {:.1f})", row.second_pct()) : "";
  fmt::print("| {} | {} | {} | {:.1f} / {:.1f}{} | {:.2f} | {:.1f} | {} | {} | {} | {} | {} | {:.1f} | {} | {} |\n",
             name, drive, goal.text(), row.nrmse().median, row.nrmse().worst, second, row.median_gain(),
             row.direction_deg().median, row.worst([](const Measured& m) { return m.figures.onset_error_frames; }),
             row.worst([](const Measured& m) { return m.figures.release_error_frames; }),
             row.max([](const Measured& m) { return m.figures.false_contact_frames; }),
             row.max([](const Measured& m) { return m.figures.missed_force_frames; }),
             row.max([](const Measured& m) { return m.figures.reversed_ok_frames; }), row.worst_between_pct(),
             band_text(row),
             holds(goal, row, tip) ? "yes"
             : row.flagged()       ? "flagged"
                                   : "NO");
  std::fflush(stdout);
}

bool is_wanted(const Arguments& arguments, const std::string& check, const std::string& sequence) {
  return arguments.names.empty() ||
         std::any_of(arguments.names.begin(), arguments.names.end(), [&](const std::string& name) {
           return name == check || name == sequence || name == check + "/" + sequence;
         });
}

Row measure_seeds(const Arguments& arguments, const Check& check, const std::string& sequence_name,
                  const std::string& drive) {
  Row row;
  const int seeds = is_dejavu(sequence_name) ? arguments.seeds : 1;
  for (int seed = 0; seed < seeds; ++seed) {
    const std::string made = check.made_with.empty() ? sequence_name : check.name + "_" + sequence_name;
    const std::string name = seeds > 1 ? fmt::format("{}_{}", made, seed) : made;
    const Sequence sequence = is_dejavu(sequence_name)
                                  ? rendered(name, changed(dejavu_scene(sequence_name, seed), check.made_with),
                                             arguments.folder / "sequences" / fmt::format("{}_{}", made, seed))
                                  : reference_sequence(sequence_name);
    const std::filesystem::path results =
        arguments.folder / "runs" / check.name / fmt::format("{}_{}_{}", sequence_name, seed, drive);
    std::vector<SceneChange> told = check.told(sequence, results);
    if (drive != "as it is") told.push_back({"contact.drive", YAML::Node(drive)});
    if (const auto measured = measure(sequence, told, results))
      row.measured.push_back(*measured);
    else
      ++row.failed;
  }
  return row;
}

void run_check(const Arguments& arguments, const Check& check, const std::string& sequence) {
  const std::string name = check.name + "/" + sequence;
  const Goal goal = goal_of(check, sequence);
  try {
    const Row tip = measure_seeds(arguments, check, sequence, "tip");
    print_row(name, "fused", goal, measure_seeds(arguments, check, sequence, "fused"), tip);
    print_row(name, "tip", goal, tip, std::nullopt);
  } catch (const BadInput& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  app::choose_blas_core(argv);
  Arguments arguments;
  CLI::App app("What must hold on sequences with known force");
  app.add_option("names", arguments.names, "check, sequence, or check/sequence; all when none is named");
  app.add_option("--seeds", arguments.seeds, "looks and noises of each DejaVu sequence")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("-o,--output", arguments.folder, "recordings and results")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print(
        "| check/sequence | drive | goal, NRMSE % | NRMSE % median / worst | gain | direction deg | onset | release | "
        "false contact | missed | ok and reversed | false force % | band % / half width % | holds |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const Check& check : all_checks())
      for (const std::string& sequence : check.sequences)
        if (is_wanted(arguments, check.name, sequence)) run_check(arguments, check, sequence);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 4;
  }
}
