#include "palpate/instrument/tip_track.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/core/table.h"
#include "palpate/core/time_column.h"

namespace palpate {

namespace {

/// A robot's log has one row per frame of a video, 1 to 1000 in a second, or its own rate, 5 to 5000.
constexpr TimeHints kFrames = {.span_s = 0, .longest_step_s = 1, .shortest_step_s = 1e-3};
constexpr TimeHints kOwnRate = {.span_s = 0, .longest_step_s = 0.2, .shortest_step_s = 2e-4};
/// No tip stays within so little of the camera, or of a robot's base, in mm; in m all of them do.
constexpr double kMetres = 3;

std::vector<TableColumn> track_columns() {
  std::vector<TableColumn> columns = time_columns();
  columns.push_back({"frame", {"framenumber", "frameindex", "frameid", "frameno", "bild"}});
  columns.push_back({"x_mm", {"position.x", "translation.x", "x", "tipx", "positionx", "posx", "px"}});
  columns.push_back({"y_mm", {"position.y", "translation.y", "y", "tipy", "positiony", "posy", "py"}});
  columns.push_back({"z_mm", {"position.z", "translation.z", "z", "tipz", "positionz", "posz", "pz"}});
  columns.push_back({"closed", {"jawclosed", "gripperclosed", "grasp"}});
  return columns;
}

void require_finite(double value, const Table& table, const Table::Row& row, const char* column) {
  if (!std::isfinite(value))
    throw BadInput(fmt::format("{}:{}: {} is '{}', expected a finite number; {}", table.file().string(), row.line,
                               column, table.text(row, column), table.header_found()));
}

/// "field.transform.translation.x": messages of ROS are in metres.
bool is_ros_message(const Table& table) {
  const std::string header = table.header_found();
  return header.find("position.x") != std::string::npos || header.find("translation.x") != std::string::npos;
}

/// Turned into mm where the numbers are metres. Throws BadInput where nothing says so.
void settle_unit(const Table& table, TipTrack& track) {
  double largest = 0;
  for (const auto& [frame, row] : track.rows) largest = std::max(largest, row.tip_mm.cwiseAbs().maxCoeff());
  if (!table.stated_unit("x_mm").empty() || largest >= kMetres) return;
  if (!is_ros_message(table))
    throw BadInput(
        fmt::format("{}: x, y, z are {:g} at most and the header states no unit, expected x_m, y_m, z_m for "
                    "metres or x_mm, y_mm, z_mm for millimetres; {}",
                    table.file().string(), largest, table.header_found()));
  for (auto& [frame, row] : track.rows) row.tip_mm *= 1000;
}

int frame_of(const Table& table, const Table::Row& line) {
  const double frame = table.number(line, "frame");
  if (!(frame >= 0 && frame <= 1e9) || frame != std::floor(frame))
    throw BadInput(fmt::format("{}:{}: frame is '{}', expected a whole number from 0; {}", table.file().string(),
                               line.line, table.text(line, "frame"), table.header_found()));
  return static_cast<int>(frame);
}

/// Counted from 1, every row would be paired with the picture after its own.
void require_frames_from_zero(const Table& table, const TipTrack& track) {
  const auto& [frame, row] = *track.rows.begin();
  if (track.has_frames && frame == 1 && row.time_s == 0 && track.rows.size() > 1)
    throw BadInput(
        fmt::format("{}:{}: frame 1 is at 0 s, expected frames that count from 0, or no column frame: rows "
                    "are found by their time then; {}",
                    table.file().string(), table.rows().front().line, table.header_found()));
}

}  // namespace

TipTrack read_tip_track(const std::filesystem::path& file) {
  const Table table(file, track_columns());
  table.require({"x_mm", "y_mm", "z_mm"});
  TipTrack track;
  track.has_frames = table.has("frame");
  if (!track.has_frames && !table.has("time_s") && !table.has("stamp.secs"))
    throw BadInput(
        fmt::format("{}: no column frame and none time_s, expected either; {}", file.string(), table.header_found()));
  const std::vector<double> times = times_s(table, track.has_frames ? kFrames : kOwnRate);
  for (size_t i = 0; i < times.size(); ++i) {
    const Table::Row& line = table.rows()[i];
    const std::string place = fmt::format("{}:{}", file.string(), line.line);
    TipTrack::Row row;
    row.time_s = times[i];
    require_finite(row.time_s, table, line, "time_s");
    int axis = 0;
    for (const char* column : {"x_mm", "y_mm", "z_mm"}) {
      row.tip_mm[axis] = table.number(line, column);
      require_finite(row.tip_mm[axis++], table, line, column);
    }
    if (table.has("closed")) {
      const double closed = table.number(line, "closed");
      if (closed != 0 && closed != 1)
        throw BadInput(fmt::format("{}: closed is '{}', expected 0 or 1", place, table.text(line, "closed")));
      row.closed = closed == 1;
    }
    if (!track.has_frames && i > 0 && row.time_s < times[i - 1])
      throw BadInput(fmt::format("{}: time {:.15g} s after {:.15g} s, expected time that grows; {}", place, row.time_s,
                                 times[i - 1], table.header_found()));
    const int number = track.has_frames ? frame_of(table, line) : static_cast<int>(i);
    if (!track.rows.emplace(number, row).second)
      throw BadInput(fmt::format("{}: frame {} stands twice in the tip track", place, table.text(line, "frame")));
  }
  if (track.rows.empty()) throw BadInput(fmt::format("{}: the tip track has no rows", file.string()));
  require_frames_from_zero(table, track);
  settle_unit(table, track);
  return track;
}

}  // namespace palpate
