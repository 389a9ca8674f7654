#pragma once

#include "palpate/console/api.h"

namespace palpate {

/// Run folders below the root: {"runs": [{folder, frames, peak_force_N}, ...]}.
Answer list_runs(const RootFolder& root);
/// Rows, marks and frames per second of a finished run, and for which of its frames there are shapes.
Answer replay_rows(const std::filesystem::path& folder);
/// A frame of its overlay.mp4 as JPEG.
Answer replay_picture(const std::filesystem::path& folder, int frame);
/// The newest shape up to a frame; the map at rest before the first.
Answer replay_shape(const std::filesystem::path& folder, int frame);
/// report.html
Answer replay_report(const std::filesystem::path& folder);

}  // namespace palpate
