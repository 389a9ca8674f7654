#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "study/plan.h"

namespace palpate::study {

/// Every figure of a study as a still picture in `folder`/figures: charts as SVG, drawn by gnuplot from scripts that
/// hold their data (NAME.gp, to be drawn again or changed), and pictures of what was estimated (JPEG). Adds to each
/// experiment of `page` (gather_study) its `pictures`, file and caption, and of a single run its `clip`. Without
/// gnuplot there are no charts; returns whether it was found.
bool write_study_figures(nlohmann::ordered_json& page, const Plan& plan, const std::filesystem::path& folder);

}  // namespace palpate::study
