#include "study/jobs.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <nlohmann/json.hpp>

#include "study/work.h"

namespace palpate::study {

namespace {

constexpr const char* kSequencePrefix = "sequence:";

std::string quoted(const std::string& word) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || std::strchr("_-./:=,+@%", c);
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), is_plain)) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

std::vector<Job> jobs_of(const Plan& plan, const std::vector<std::string>& command) {
  std::vector<Job> jobs;
  const auto add = [&](const std::string& name, const std::filesystem::path& place, const char* makes,
                       const std::filesystem::path& needs) {
    Job job{name, place / makes, needs, place / "log.txt", command};
    job.words.insert(job.words.end(), {"--run", name});
    jobs.push_back(job);
  };
  for (const Sequence& sequence : plan.sequences)
    add(kSequencePrefix + sequence.name, sequence_folder(sequence.name, ""), kSequenceDone, "");
  for (const Run& run : plan.runs)
    add(run.name, run_folder(run, ""), kRunResult,
        run.sequence.empty() ? "" : sequence_folder(run.sequence, "") / kSequenceDone);
  return jobs;
}

std::vector<Job> jobs_left(const std::vector<Job>& jobs, const Plan& plan, const std::filesystem::path& folder) {
  for (const Run& run : plan.runs)
    if (const auto result = result_of(run, folder); result.is_null() || result["status"] == "skipped")
      std::filesystem::remove(run_folder(run, folder) / kRunResult);
  std::vector<Job> left;
  for (const Job& job : jobs)
    if (!std::filesystem::exists(folder / job.makes)) left.push_back(job);
  return left;
}

std::string shell_line(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + quoted(word);
  return line;
}

}  // namespace palpate::study
