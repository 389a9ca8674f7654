#include "palpate/console/row_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {

double rounded(double value) {
  if (!std::isfinite(value)) return 0;
  return std::round(value * 1e6) / 1e6;
}

nlohmann::ordered_json row_json(const ForceRow& row) {
  return {row.frame,
          rounded(row.time_s),
          row.status,
          row.in_contact ? 1 : 0,
          rounded(row.force_N.x()),
          rounded(row.force_N.y()),
          rounded(row.force_N.z()),
          rounded(row.force_magnitude_N),
          rounded(row.force_low_N),
          rounded(row.force_high_N),
          rounded(row.tip_mm.x()),
          rounded(row.tip_mm.y()),
          rounded(row.tip_mm.z()),
          rounded(row.max_von_mises_kPa),
          rounded(row.frame_ms),
          row.warnings,
          row.grip,
          rounded(row.p_contact),
          rounded(row.footprint_mm)};
}

}  // namespace palpate
