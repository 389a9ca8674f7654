#include "study/engines.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "palpate/core/errors.h"
#include "study/files.h"

namespace palpate::study {

namespace {

/// A path or a command in a ninja file.
std::string in_ninja(const std::string& text, bool is_path) {
  std::string escaped;
  for (const char c : text) {
    if (c == '$' || (is_path && (c == ' ' || c == ':'))) escaped += '$';
    escaped += c;
  }
  return escaped;
}

std::string ninja_file(const std::vector<Job>& jobs) {
  std::string text =
      "rule job\n  command = mkdir -p $$(dirname $log) && $words > $log 2>&1 || (echo see $log; false)\n"
      "  description = $name\n";
  for (const Job& job : jobs) {
    text += fmt::format("build {}: job", in_ninja(job.makes.string(), true));
    if (!job.needs.empty()) text += " | " + in_ninja(job.needs.string(), true);
    text += fmt::format("\n  name = {}\n  log = {}\n  words = {}\n", in_ninja(job.name, false),
                        in_ninja(shell_line({job.log.string()}), false), in_ninja(shell_line(job.words), false));
  }
  return text;
}

constexpr int kNotFound = 127;  // as a shell says

constexpr const char* kSnakefile = R"py(

rule all:
    input: f"{FOLDER}/results.csv"

rule collect:
    input: [f"{FOLDER}/{job['makes']}" for job in JOBS.values()]
    output: f"{FOLDER}/results.csv"
    shell: "{COLLECT}"

def job(makes):
    return JOBS[makes]

rule sequence:
    output: f"{FOLDER}/sequences/{{name}}/done"
    params: words=lambda wildcards: job(f"sequences/{wildcards.name}/done")["line"]
    shell: "{params.words}"

rule run:
    input: lambda wildcards: [f"{FOLDER}/{needs}" for needs in job(f"runs/{wildcards.name}/result.json")["needs"]]
    output: f"{FOLDER}/runs/{{name}}/result.json"
    params: words=lambda wildcards: job(f"runs/{wildcards.name}/result.json")["line"]
    shell: "{params.words}"
)py";

constexpr const char* kProfile =
    R"yaml(cluster: "sbatch --parsable --job-name=palpate --cpus-per-task={threads} --output=/dev/null"
cluster-status: "{HERE}/profile/status.sh"
jobs: 100
keep-going: true
restart-times: 2
rerun-incomplete: true
latency-wait: 60
)yaml";

constexpr const char* kStatus = R"sh(#!/usr/bin/env bash
# What Snakemake asks of a job that Slurm runs: success, running or failed.
case $(scontrol show job --oneliner "$1" | grep -o 'JobState=[A-Z_]*') in
  *=COMPLETED) echo success ;;
  *=PENDING | *=CONFIGURING | *=RUNNING | *=COMPLETING | *=SUSPENDED | *=REQUEUED | *=RESIZING) echo running ;;
  *) echo failed ;;
esac
)sh";

constexpr const char* kArray = R"sh(#!/usr/bin/env bash
#SBATCH --job-name=palpate --output=/dev/null
# One line of a list of command lines, by the number of the task:  sbatch --array=1-N array.sh LIST
eval "$(sed -n "${SLURM_ARRAY_TASK_ID}p" "$1")"
)sh";

constexpr const char* kSubmit = R"sh(#!/usr/bin/env bash
# Sequences, then runs, then the tables. Submitted again, it does all runs again.
set -euo pipefail
cd "$(dirname "$0")"
after=
for list in sequences runs; do
  lines=$(wc -l <"$list.txt")
  [ "$lines" -gt 0 ] || continue
  job=$(sbatch --parsable $after --array="1-$lines" array.sh "$PWD/$list.txt")
  after=--dependency=afterany:$job
done
sbatch --parsable $after --job-name=palpate --output=/dev/null collect.sh
)sh";

/// A command line that leaves its words in the job's log.
std::string logged(const Job& job, const std::filesystem::path& folder) {
  const std::string log = shell_line({(folder / job.log).string()});
  return fmt::format("mkdir -p {} && {} > {} 2>&1", shell_line({(folder / job.log).parent_path().string()}),
                     shell_line(job.words), log);
}

void write_script(const std::filesystem::path& file, const std::string& text) {
  write_file(file, text);
  std::filesystem::permissions(file, std::filesystem::perms::owner_exec, std::filesystem::perm_options::add);
}

}  // namespace

int run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                const std::function<bool()>& stopped) {
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t process = fork();
  if (process == 0) {
    dup2(STDERR_FILENO, STDOUT_FILENO);
    if (chdir(folder.c_str()) == 0) execvp(arguments[0], arguments.data());
    _exit(kNotFound);
  }
  int status = 0;
  bool told = false;
  while (process > 0) {
    const pid_t ended = waitpid(process, &status, WNOHANG);
    if (ended != 0) return ended == process && WIFEXITED(status) ? WEXITSTATUS(status) : 1;
    if (stopped() && !told) told = kill(process, SIGINT) == 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return kNotFound;
}

void run_by_ninja(const std::vector<Job>& jobs, const std::filesystem::path& folder, int at_once, bool quiet,
                  const std::function<bool()>& stopped) {
  if (jobs.empty()) return;
  write_file(folder / "study.ninja", ninja_file(jobs));
  std::vector<std::string> words = {"ninja", "-f", "study.ninja", "-k", "0", "-j", std::to_string(at_once)};
  if (quiet) words.emplace_back("--quiet");
  if (run_program(words, folder, stopped) == kNotFound)
    throw BadInput("ninja, which runs the study, is not installed (apt-get install ninja-build)");
  if (stopped()) throw Unfinished("interrupted; the same command goes on with what is left");
}

void export_snakemake(const std::vector<Job>& jobs, const std::vector<std::string>& collect,
                      const std::filesystem::path& folder, const std::filesystem::path& to) {
  nlohmann::ordered_json list;
  for (const Job& job : jobs) {
    auto& entry = list[job.makes.string()];
    entry = {{"makes", job.makes.string()}, {"line", logged(job, folder)}, {"needs", nlohmann::json::array()}};
    if (!job.needs.empty()) entry["needs"].push_back(job.needs.string());
  }
  const auto text = [](const std::string& words) { return nlohmann::json(words).dump(); };  // as Python reads it
  std::filesystem::create_directories(to / "profile");
  write_file(
      to / "Snakefile",
      fmt::format(
          "# snakemake --snakefile {0}/Snakefile --profile {0}/profile\nFOLDER = {1}\nCOLLECT = {2}\nJOBS = {3}\n",
          to.string(), text(folder.string()), text(shell_line(collect)), list.dump(2)) +
          kSnakefile);
  std::string profile = kProfile;
  const std::string here = "{HERE}";
  profile.replace(profile.find(here), here.size(), to.string());
  write_file(to / "profile/config.yaml", profile);
  write_script(to / "profile/status.sh", kStatus);
}

void export_slurm(const std::vector<Job>& jobs, const std::vector<std::string>& collect,
                  const std::filesystem::path& folder, const std::filesystem::path& to) {
  std::string sequences, runs;
  for (const Job& job : jobs) (job.name.starts_with("sequence:") ? sequences : runs) += logged(job, folder) + "\n";
  std::filesystem::create_directories(to);
  write_file(to / "sequences.txt", sequences);
  write_file(to / "runs.txt", runs);
  write_script(to / "array.sh", kArray);
  write_script(to / "collect.sh", "#!/usr/bin/env bash\n" + shell_line(collect) + "\n");
  write_script(to / "submit.sh", kSubmit);
}

}  // namespace palpate::study
