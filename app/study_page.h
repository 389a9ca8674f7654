#pragma once

#include <filesystem>

#include "app/study_file.h"

namespace palpate::app {

/// Gathers what the runs have left in `folder`: results.csv, one row per run with every figure or the reason why there
/// are none, and report.html, one page with tables, goals and charts that needs no network. Returns how many runs are
/// done, failed and missing.
struct StudyCount {
  int done = 0, failed = 0, missing = 0;
};
StudyCount collect_study(const Study& study, const StudyPlan& plan, const std::filesystem::path& folder);

}  // namespace palpate::app
