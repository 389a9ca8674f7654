#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "study/plan.h"

namespace palpate::study {

/// One command line, what it makes and what has to be there before; paths below the study's folder.
struct Job {
  std::string name;                    ///< what --run takes
  std::filesystem::path makes, needs;  ///< `needs` may be empty
  std::filesystem::path log;
  std::vector<std::string> words;  ///< command line
};

/// A plan as jobs, sequences first. `command`: the words before the name of the job.
std::vector<Job> jobs_of(const Plan& plan, const std::vector<std::string>& command);

/// Those whose results are not in `folder`; old results with other settings are deleted.
std::vector<Job> jobs_left(const std::vector<Job>& jobs, const Plan& plan, const std::filesystem::path& folder);

/// Words as a shell takes them.
std::string shell_line(const std::vector<std::string>& words);

}  // namespace palpate::study
