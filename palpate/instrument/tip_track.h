#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include "palpate/core/geometry.h"

namespace palpate {

/// tip.csv: columns frame, time_s, x_mm, y_mm, z_mm and perhaps closed, as any program writes a table (`Table`; lengths
/// in the unit that the header states), left camera frame. Throws BadInput with file and line.
struct TipTrack {
  struct Row {
    double time_s = 0;
    Vec3 tip_mm = Vec3::Zero();
    std::optional<bool> closed;
  };
  std::map<int, Row> rows;  ///< by frame number
};
TipTrack read_tip_track(const std::filesystem::path& file);

}  // namespace palpate
