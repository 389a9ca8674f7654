#include "palpate/instrument/tip_track.h"

#include <fmt/format.h>

#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/core/table.h"
#include "palpate/core/time_column.h"

namespace palpate {

namespace {

/// A robot's log has one row per frame of a video: 1 to 1000 in a second.
constexpr TimeHints kFrames = {.span_s = 0, .longest_step_s = 1, .shortest_step_s = 1e-3};

std::vector<TableColumn> track_columns() {
  std::vector<TableColumn> columns = time_columns();
  columns.push_back({"frame", {"framenumber", "frameindex", "frameid", "frameno", "bild"}});
  columns.push_back({"x_mm", {"x", "tipx", "position.x", "positionx", "posx", "px"}});
  columns.push_back({"y_mm", {"y", "tipy", "position.y", "positiony", "posy", "py"}});
  columns.push_back({"z_mm", {"z", "tipz", "position.z", "positionz", "posz", "pz"}});
  columns.push_back({"closed", {"jawclosed", "gripperclosed", "grasp"}});
  return columns;
}

void require_finite(double value, const Table& table, const Table::Row& row, const char* column) {
  if (!std::isfinite(value))
    throw BadInput(fmt::format("{}:{}: {} is '{}', expected a finite number", table.file().string(), row.line, column,
                               table.text(row, column)));
}

}  // namespace

TipTrack read_tip_track(const std::filesystem::path& file) {
  const Table table(file, track_columns());
  table.require({"frame", "x_mm", "y_mm", "z_mm"});
  const std::vector<double> times = times_s(table, kFrames);
  TipTrack track;
  for (size_t i = 0; i < times.size(); ++i) {
    const Table::Row& line = table.rows()[i];
    const std::string place = fmt::format("{}:{}", file.string(), line.line);
    const double frame = table.number(line, "frame");
    if (!(frame >= 0 && frame <= 1e9) || frame != std::floor(frame))
      throw BadInput(
          fmt::format("{}: frame is '{}', expected a whole number from 0", place, table.text(line, "frame")));
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
    if (!track.rows.emplace(static_cast<int>(frame), row).second)
      throw BadInput(fmt::format("{}: frame {} stands twice in the tip track", place, table.text(line, "frame")));
  }
  if (track.rows.empty()) throw BadInput(fmt::format("{}: the tip track has no rows", file.string()));
  return track;
}

}  // namespace palpate
