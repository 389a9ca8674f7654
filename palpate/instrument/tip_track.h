#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include "palpate/core/geometry.h"

namespace palpate {

/// tip.csv: columns frame, time_s, x_mm, y_mm, z_mm and perhaps closed, as any program writes a table (`Table`; lengths
/// in the unit that the header states, else in mm, of messages of ROS in m where the numbers are so small), left camera
/// frame. Without frame the rows are found by their time. Throws BadInput with file and line, also where the numbers
/// are metres that no unit says, or frame 1 is at 0 s: frames count from 0.
struct TipTrack {
  struct Row {
    double time_s = 0;
    Vec3 tip_mm = Vec3::Zero();
    std::optional<bool> closed;
  };
  std::map<int, Row> rows;  ///< by frame number; without one, in the order of their time
  bool has_frames = true;
};
TipTrack read_tip_track(const std::filesystem::path& file);

}  // namespace palpate
