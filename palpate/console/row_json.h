#pragma once

#include <nlohmann/json_fwd.hpp>

#include "palpate/feedback/forces_file.h"

namespace palpate {

/// A number as a page can show it; 0 where it is none.
double rounded(double value);

/// One row as a list: frame, time_s, status, in_contact, fx_N, fy_N, fz_N, force_N, force_low_N, force_high_N,
/// tip_x_mm, tip_y_mm, tip_z_mm, max_von_mises_kPa, frame_ms, warnings, grip, p_contact, footprint_mm.
nlohmann::ordered_json row_json(const ForceRow& row);

}  // namespace palpate
