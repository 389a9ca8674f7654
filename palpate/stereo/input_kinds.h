#pragma once

#include <vector>

#include "palpate/core/input_kind.h"
#include "palpate/stereo/calibration_tree.h"

namespace palpate {

/// What read_rig takes.
std::vector<InputKind> calibration_kinds();

/// Of a file that was read, the kind that its keys show; one of calibration_kinds().
std::string calibration_kind(const std::vector<CalibrationEntry>& entries);

/// What Recording takes.
std::vector<InputKind> recording_kinds();

}  // namespace palpate
