#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "app/answer.h"
#include "app/run.h"
#include "app/share_folder.h"
#include "app/simulation.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"
#include "palpate/session/output_folder.h"

namespace palpate::app {

namespace {

namespace fs = std::filesystem;

/// What the sheet of results has of each sequence, as score.py has it; names of figures_of().
constexpr std::array kSheet = {"force_nrmse_pct",
                               "gain",
                               "direction_error_deg_median",
                               "onset_error_frames",
                               "release_error_frames",
                               "false_contact_frames",
                               "missed_force_frames",
                               "reversed_ok_frames",
                               "band_coverage_pct",
                               "band_half_width_pct"};

/// The scenes that the sequences are made of, by name.
std::vector<fs::path> scenes_of(const fs::path& handed_out, const std::vector<std::string>& only) {
  std::vector<fs::path> all, chosen;
  std::string names;
  for (const auto& entry : fs::directory_iterator(handed_out))
    if (entry.path().extension() == ".yaml") all.push_back(entry.path());
  std::sort(all.begin(), all.end());
  for (const fs::path& scene : all) names += (names.empty() ? "" : ", ") + scene.stem().string();
  for (const std::string& name : only)
    if (std::none_of(all.begin(), all.end(), [&name](const fs::path& s) { return s.stem() == name; }))
      throw WrongUse(fmt::format("--only {}: no such sequence, expected one of: {}", name, names));
  for (const fs::path& scene : all)
    if (only.empty() || std::find(only.begin(), only.end(), scene.stem().string()) != only.end())
      chosen.push_back(scene);
  return chosen;
}

double size_MB(const fs::path& folder) {
  double bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += static_cast<double>(entry.file_size());
  return bytes * 1e-6;
}

/// One line of the sheet of results.
std::string sheet_row(const std::string& name, const Comparison& comparison) {
  const auto all = figures_of(comparison);
  std::string row = name;
  for (const std::string wanted : kSheet)
    for (const auto& [figure, value] : all)
      if (figure == wanted) row += "," + (value.index() == 0 ? "" : figure_text(value));
  return row + "\n";
}

void export_benchmark(const fs::path& folder, const std::vector<std::string>& only, bool quiet) {
  const fs::path handed_out = share_folder() / "benchmark";
  if (!fs::exists(handed_out / "score.py"))
    throw BadInput(
        fmt::format("{}: the benchmark's scenes are not there, expected beside the program (cmake "
                    "--install puts them there)",
                    handed_out.string()));
  const std::vector<fs::path> scenes = scenes_of(handed_out, only);
  require_output_folder(folder);
  fs::create_directories(folder / "results");
  for (const char* name : {"README.md", "score.py"})
    write_whole_file(folder / name, read_whole_file(handed_out / name));
  std::string sheet = fmt::format("sequence,{}\n", fmt::join(kSheet, ","));
  for (size_t i = 0; i < scenes.size(); ++i) {
    const std::string name = scenes[i].stem().string(), made_of = read_whole_file(scenes[i]);
    const fs::path sequence = folder / name, results = folder / "results" / name;
    if (!quiet) fmt::print(stderr, "{} of {}: {}\n", i + 1, scenes.size(), name);
    // What stands there from an earlier, interrupted run is taken as it is, with the results that belong to it.
    if (read_whole_file(sequence / "made_of.yaml") != made_of) {
      fs::remove_all(results);
      DejaVuSummary summary;
      simulate_into(read_scene_file(scenes[i], false), sequence, quiet, summary);
      write_whole_file(sequence / "made_of.yaml", made_of);
    }
    if (!fs::exists(results / "report.html"))
      run_estimate(read_scene_file(sequence / "scene.yaml", true), {results, sequence / "truth.csv", true});
    sheet += sheet_row(name, compare(read_forces(results / "forces.csv"), read_truth(sequence / "truth.csv")));
    if (fs::exists(sequence / "truth_2.csv") && fs::exists(results / "forces_2.csv"))
      sheet += sheet_row("\"" + name + ", second\"",
                         compare(read_forces(results / "forces_2.csv"), read_truth(sequence / "truth_2.csv")));
  }
  write_whole_file(folder / "results/scores.csv", sheet);
  if (!quiet)
    fmt::print("{} sequences, {:.0f} MB, CC0 1.0; how to enter stands in {}\n", scenes.size(), size_MB(folder),
               (folder / "README.md").string());
}

}  // namespace

void add_benchmark(CLI::App& app) {
  struct Arguments {
    fs::path folder;
    std::vector<std::string> only;
    bool quiet = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("benchmark", "Sequences with known force, for other groups' estimators");
  verb->require_subcommand(1);
  CLI::App* make = verb->add_subcommand(
      "export", "Writes sequences with truth, their scenes, a scorer and the sheet of Palpate's own results");
  make->add_option("folder", arguments->folder, "where they go")->required()->type_name("FOLDER");
  make->add_option("--only", arguments->only, "these sequences alone")->type_name("NAME");
  make->add_flag("--quiet", arguments->quiet, "no progress");
  make->footer("Example: palpate benchmark export benchmark && python3 benchmark/score.py benchmark benchmark/results");
  make->callback([arguments] { export_benchmark(arguments->folder, arguments->only, arguments->quiet); });
}

}  // namespace palpate::app
