#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/progress.h"
#include "app/study_jobs.h"
#include "app/study_page.h"
#include "app/study_run.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/session/output_folder.h"

namespace palpate::app {

namespace {

constexpr const char* kSequencePrefix = "sequence:";

struct Arguments {
  std::filesystem::path study, folder = "palpate_study";
  std::string only, run;
  bool quick = false, list_runs = false, collect = false, json = false;
  int jobs = 1;
};

/// Without what --only leaves out, and without sequences that nobody needs then. Copied, not erased in place: assigning
/// to a YAML::Node changes every other that shares it.
StudyPlan selected(const StudyPlan& plan, const std::string& pattern) {
  if (pattern.empty()) return plan;
  StudyPlan chosen;
  for (const StudyRun& run : plan.runs)
    if (fnmatch(pattern.c_str(), run.name.c_str(), 0) == 0 ||
        fnmatch(pattern.c_str(), run.experiment->name.c_str(), 0) == 0)
      chosen.runs.push_back(run);
  if (chosen.runs.empty()) throw BadInput(fmt::format("--only {}: no run has such a name (see --list-runs)", pattern));
  for (const StudySequence& sequence : plan.sequences)
    if (std::any_of(chosen.runs.begin(), chosen.runs.end(),
                    [&sequence](const StudyRun& run) { return run.sequence == sequence.name; }))
      chosen.sequences.push_back(sequence);
  return chosen;
}

std::vector<std::string> command_of(const Arguments& arguments, const std::string& name) {
  std::vector<std::string> words = {"study", arguments.study.string(), "-o", arguments.folder.string()};
  if (arguments.quick) words.emplace_back("--quick");
  words.insert(words.end(), {"--run", name});
  return words;
}

void run_one(const Arguments& arguments, const Study& study, const StudyPlan& plan) {
  for (const StudySequence& sequence : plan.sequences)
    if (kSequencePrefix + sequence.name == arguments.run) return make_sequence(sequence, study, arguments.folder);
  for (const StudyRun& run : plan.runs) {
    if (run.name != arguments.run) continue;
    for (const StudySequence& sequence : plan.sequences)
      if (sequence.name == run.sequence) make_sequence(sequence, study, arguments.folder);
    return make_run(run, arguments.folder);
  }
  throw BadInput(fmt::format("--run {}: the study has no such run (see --list-runs)", arguments.run));
}

/// Sequences first, then the estimates; what is there already stays.
void run_all(const Arguments& arguments, const StudyPlan& plan) {
  const auto job = [&arguments](const std::string& name, const std::filesystem::path& log) {
    return StudyJob{name, command_of(arguments, name), log};
  };
  std::vector<StudyJob> sequences, runs;
  for (const StudySequence& sequence : plan.sequences)
    if (!sequence_is_there(sequence, arguments.folder))
      sequences.push_back(
          job(kSequencePrefix + sequence.name, sequence_folder(sequence.name, arguments.folder) / "log.txt"));
  for (const StudyRun& run : plan.runs)
    if (const auto result = result_of(run, arguments.folder); result.is_null() || result["status"] == "skipped")
      runs.push_back(job(run.name, run_folder(run, arguments.folder) / "log.txt"));
  Progress progress("study", arguments.json);
  const int total = static_cast<int>(sequences.size() + runs.size());
  int done = 0;
  const auto ended = [&](const StudyJob& ended_job, int exit_code) {
    progress.show(++done, total, ended_job.name);
    if (exit_code != kDone && !arguments.json)
      fmt::print(stderr, "{}: exit code {}, see {}\n", ended_job.name, exit_code, ended_job.log.string());
  };
  run_jobs(sequences, arguments.jobs, ended);
  run_jobs(runs, arguments.jobs, ended);
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
  verb->add_option("--run", arguments->run, "make this one only")->type_name("NAME");
  verb->add_flag("--collect", arguments->collect,
                 "only gather what is there into results.csv, report.html, results.md and figures");
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer(
      "A study that was broken off goes on where it stopped.\n"
      "Example: palpate study studies/paper.yaml -o paper --quick && xdg-open paper/report.html");
  verb->callback([arguments] {
    const Study study = read_study(arguments->study, arguments->quick);
    const StudyPlan plan = selected(plan_of(study), arguments->only);
    if (arguments->list_runs) {
      const auto print = [&](const std::string& name) {
        fmt::print("palpate {}\n", fmt::join(command_of(*arguments, name), " "));
      };
      for (const StudySequence& sequence : plan.sequences) print(kSequencePrefix + sequence.name);
      for (const StudyRun& run : plan.runs) print(run.name);
      return;
    }
    require_output_folder(arguments->folder);
    if (!arguments->run.empty()) return run_one(*arguments, study, plan);
    if (!arguments->collect) run_all(*arguments, plan);
    std::filesystem::create_directories(arguments->folder);
    const StudyCount count = collect_study(study, plan, arguments->folder);
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
