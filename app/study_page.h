#pragma once

#include <filesystem>

#include "app/study_file.h"

namespace palpate::app {

struct StudyCount {
  int done = 0, failed = 0, skipped = 0, missing = 0;
  bool drew_charts = true;  ///< false without gnuplot
};

/// Gathers what the runs have left in `folder`: results.csv, one row per run with every figure or the reason why there
/// are none; report.html, one page with tables, goals and charts that needs no network; results.md with the still
/// pictures of figures/. Returns how many runs are done, failed, skipped (data not on this machine) and missing.
StudyCount collect_study(const Study& study, const StudyPlan& plan, const std::filesystem::path& folder);

}  // namespace palpate::app
