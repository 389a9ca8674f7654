#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/run.h"
#include "app/runtime.h"
#include "app/simulation.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/session/output_folder.h"
#include "study/collect.h"
#include "study/engines.h"
#include "study/jobs.h"
#include "study/work.h"

namespace palpate::app {

namespace {

using study::Plan;
using study::Study;

struct Arguments {
  std::filesystem::path study, folder = "palpate_study";
  std::string only, run, engine;
  bool quick = false, list_runs = false, collect = false, json = false;
  int jobs = 1;
};

/// Without what --only leaves out, and without sequences that nobody needs then. Copied, not erased in place: assigning
/// to a YAML::Node changes every other that shares it.
Plan selected(const Plan& plan, const std::string& pattern) {
  if (pattern.empty()) return plan;
  Plan chosen;
  for (const study::Run& run : plan.runs)
    if (fnmatch(pattern.c_str(), run.name.c_str(), 0) == 0 ||
        fnmatch(pattern.c_str(), run.experiment->name.c_str(), 0) == 0)
      chosen.runs.push_back(run);
  if (chosen.runs.empty()) throw BadInput(fmt::format("--only {}: no run has such a name (see --list-runs)", pattern));
  for (const study::Sequence& sequence : plan.sequences)
    if (std::any_of(chosen.runs.begin(), chosen.runs.end(),
                    [&sequence](const study::Run& run) { return run.sequence == sequence.name; }))
      chosen.sequences.push_back(sequence);
  return chosen;
}

std::vector<std::string> command_of(const Arguments& arguments, const std::string& program) {
  std::vector<std::string> words = {program, "study", arguments.study.string(), "-o", arguments.folder.string()};
  if (arguments.quick) words.emplace_back("--quick");
  return words;
}

/// What it is from anywhere: jobs run in other folders.
Arguments from_anywhere(Arguments arguments) {
  arguments.study = std::filesystem::absolute(arguments.study);
  arguments.folder = std::filesystem::absolute(arguments.folder);
  return arguments;
}

void simulate(const std::filesystem::path& scene_file, const std::filesystem::path& folder) {
  DejaVuSummary summary;
  simulate_into(read_scene_file(scene_file, false), folder, true, summary);
}

nlohmann::ordered_json estimate(const std::filesystem::path& scene_file, const std::filesystem::path& folder,
                                const std::filesystem::path& truth) {
  return to_json(run_estimate(read_scene_file(scene_file, true), {folder, truth, true}));
}

void run_one(const Arguments& arguments, const Study& study, const Plan& plan) {
  for (const study::Sequence& sequence : plan.sequences)
    if ("sequence:" + sequence.name == arguments.run) return make_sequence(sequence, study, arguments.folder, simulate);
  for (const study::Run& run : plan.runs) {
    if (run.name != arguments.run) continue;
    for (const study::Sequence& sequence : plan.sequences)
      if (sequence.name == run.sequence) make_sequence(sequence, study, arguments.folder, simulate);
    return make_run(run, arguments.folder, estimate);
  }
  throw BadInput(fmt::format("--run {}: the study has no such run (see --list-runs)", arguments.run));
}

/// What is there already stays.
void run_all(const Arguments& arguments, const Plan& plan) {
  const Arguments full = from_anywhere(arguments);
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  std::filesystem::create_directories(full.folder);
  const auto jobs = jobs_left(jobs_of(plan, command_of(full, program)), plan, full.folder);
  study::run_by_ninja(jobs, full.folder, full.jobs, full.json, [] { return interrupted().load(); });
}

/// Into the folder, for an engine on a cluster; nothing runs.
void export_to(const Arguments& arguments, const Plan& plan) {
  Arguments full = from_anywhere(arguments);
  const std::filesystem::path to = full.folder;
  full.folder = to / "results";
  const auto jobs = jobs_of(plan, command_of(full, "palpate"));
  std::vector<std::string> collect = command_of(full, "palpate");
  collect.emplace_back("--collect");
  if (!full.only.empty()) collect.insert(collect.end(), {"--only", full.only});
  (full.engine == "slurm" ? study::export_slurm : study::export_snakemake)(jobs, collect, full.folder, to);
}

}  // namespace

void add_study(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("study", "Experiments and sweeps: many sequences and estimates, one page");
  verb->add_option("study", arguments->study, "study file")->required()->type_name("STUDY");
  verb->add_option("-o,--output", arguments->folder,
                   "folder for sequences, runs, results.csv, report.html, results.md and figures")
      ->type_name("FOLDER")
      ->capture_default_str();
  verb->add_flag("--quick", arguments->quick, "the short form: fewer values of each sweep");
  verb->add_option("--only", arguments->only, "runs or experiments whose name fits, such as 'modulus*'")
      ->type_name("PATTERN");
  verb->add_option("--jobs", arguments->jobs, "runs at once")->check(CLI::Range(1, 256))->capture_default_str();
  verb->add_flag("--list-runs", arguments->list_runs, "print each run's own command line, for a scheduler; do nothing");
  verb->add_option("--export", arguments->engine,
                   "write what a cluster runs the study by into the output folder; do nothing")
      ->check(CLI::IsMember({"snakemake", "slurm"}))
      ->type_name("ENGINE");
  verb->add_option("--run", arguments->run, "make this one only")->type_name("NAME");
  verb->add_flag("--collect", arguments->collect,
                 "only gather what is there into results.csv, report.html, results.md and figures");
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer(
      "A study that was broken off goes on where it stopped.\n"
      "Example: palpate study studies/paper.yaml -o paper --quick && xdg-open paper/report.html");
  verb->callback([arguments] {
    const Study study = study::read_study(arguments->study, arguments->quick);
    const Plan plan = selected(plan_of(study), arguments->only);
    if (arguments->list_runs) {
      for (const study::Job& job : jobs_of(plan, command_of(*arguments, "palpate")))
        fmt::print("{}\n", study::shell_line(job.words));
      return;
    }
    require_output_folder(arguments->folder);
    if (!arguments->engine.empty()) return export_to(*arguments, plan);
    if (!arguments->run.empty()) return run_one(*arguments, study, plan);
    if (!arguments->collect) run_all(*arguments, plan);
    std::filesystem::create_directories(arguments->folder);
    const study::Count count = collect_study(study, plan, arguments->folder);
    if (!count.drew_charts && !arguments->json)
      fmt::print(stderr, "no charts in results.md: gnuplot is missing or failed\n");
    const std::string page = (arguments->folder / "report.html").string();
    if (arguments->json)
      fmt::print("{}", json_success({{"folder", arguments->folder.string()},
                                     {"done", count.done},
                                     {"failed", count.failed},
                                     {"skipped", count.skipped},
                                     {"missing", count.missing}}));
    else
      fmt::print("{} runs done, {} failed, {} skipped, {} missing\nlook at {}\n", count.done, count.failed,
                 count.skipped, count.missing, page);
    if (count.missing > 0 && !arguments->collect)
      throw Unfinished(fmt::format("{} runs could not finish; the same command tries them again", count.missing));
  });
}

}  // namespace palpate::app
