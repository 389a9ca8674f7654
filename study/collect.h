#pragma once

#include <filesystem>

#include "study/plan.h"

namespace palpate::study {

struct Count {
  int done = 0, failed = 0, skipped = 0, missing = 0;
  bool drew_charts = true;  ///< false without gnuplot
};

/// Gathers what the runs have left in `folder`: results.csv, one row per run with every figure or the reason why there
/// are none; results.md with the pictures of figures/; report.html, the same page and the overlay clips in one file
/// that needs no network. Returns how many runs are done, failed, skipped (data not on this machine) and missing.
Count collect_study(const Study& study, const Plan& plan, const std::filesystem::path& folder);

}  // namespace palpate::study
