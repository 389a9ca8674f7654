#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace palpate::app {

/// One command line of this program, and where its words go.
struct StudyJob {
  std::string name;
  std::vector<std::string> arguments;
  std::filesystem::path log;
};

/// Runs them as processes of their own, at most `at_once` together; `ended(job, exit code)` after each. Throws
/// Unfinished when the user interrupts; what is running then ends too.
void run_jobs(const std::vector<StudyJob>& jobs, int at_once, const std::function<void(const StudyJob&, int)>& ended);

/// Runs another program in a folder and waits for it; false where it is missing or fails.
bool run_program(const std::vector<std::string>& words, const std::filesystem::path& folder);

}  // namespace palpate::app
