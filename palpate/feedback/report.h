#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/elastic/material.h"
#include "palpate/estimate/force_estimate.h"
#include "palpate/feedback/forces_file.h"

namespace palpate {

struct ReportPicture {
  cv::Mat image;  ///< 8-bit BGR
  std::string caption;
};

/// What a run leaves to read. Truth, times, settings, pictures and what is of a second
/// instrument may be empty: their part is left out.
struct Report {
  std::string title;
  std::vector<ForceRow> rows;
  std::vector<ForceRow> truth;
  std::vector<ForceRow> rows_2, truth_2;  ///< of a second instrument
  std::vector<FrameTimes> times;
  TissueOptions tissue;
  std::string settings;  ///< YAML of every setting in effect
  std::vector<ReportPicture> pictures;
};

/// One HTML page that needs nothing but itself: figures, force over time as SVG, status, tip, stage times, settings,
/// pictures (embedded). Readable on a phone, in light and dark.
std::string report_html(const Report& report);

/// Throws Unfinished when the file cannot be written.
void write_report(const std::filesystem::path& file, const Report& report);

}  // namespace palpate
