#pragma once

#include <filesystem>

#include "palpate/feedback/forces_file.h"

namespace palpate {

/// How far a tip is off, RMS, across and along the viewing ray, mm.
struct TipError {
  double lateral_mm = 0;
  double depth_mm = 0;
};

/// What the tip adds to the error of a force.
struct TipFigures {
  TipError tip;                    ///< in every frame with a tip
  TipError since_onset;            ///< of the displacement since the first frame in contact, in contact
  double worst_tip_mm = 0;         ///< of one frame
  double seen_right_fraction = 0;  ///< frames in which a tip is reported exactly where the truth shows one
};

/// `visible`: by frame of the truth, whether both cameras see the tip. Frames are matched by number.
TipFigures tip_figures(const std::vector<ForceRow>& estimate, const std::vector<ForceRow>& truth,
                       const std::vector<bool>& visible);

/// Column `visible` of a truth; where it has none, the tip is always seen.
std::vector<bool> read_visible(const std::filesystem::path& truth_file);

/// The truth as a tip track, with jaws that hold while there is contact.
void write_true_track(const std::vector<ForceRow>& truth, const std::filesystem::path& file);

}  // namespace palpate
