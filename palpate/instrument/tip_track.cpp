#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/instrument/tip_track.h"

namespace palpate {

namespace {

std::vector<std::string> split_cells(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    const auto first = cell.find_first_not_of(" \t");
    const auto last = cell.find_last_not_of(" \t");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

double number_in(const std::string& cell, const std::string& place, const std::string& column) {
  size_t read = 0;
  double value = 0;
  try {
    value = std::stod(cell, &read);
  } catch (const std::exception&) {
    read = 0;
  }
  if (read == 0 || read != cell.size() || !std::isfinite(value))
    throw BadInput(fmt::format("{}: {} is '{}', expected a finite number", place, column, cell));
  return value;
}

}  // namespace

TipTrack read_tip_track(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw BadInput(fmt::format("{}: the tip track cannot be opened", file.string()));
  const std::vector<std::string> expected = {"frame", "time_s", "x_mm", "y_mm", "z_mm"};
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> header = split_cells(line);
  const bool with_closed = header.size() == 6 && header[5] == "closed";
  if (header.size() < 5 || !std::equal(expected.begin(), expected.end(), header.begin()) ||
      (header.size() > 5 && !with_closed))
    throw BadInput(
        fmt::format("{}:1: the header is '{}', expected 'frame,time_s,x_mm,y_mm,z_mm' with 'closed' as the "
                    "only further column",
                    file.string(), line));
  TipTrack track;
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::vector<std::string> cells = split_cells(line);
    if (cells.empty() || (cells.size() == 1 && cells[0].empty())) continue;
    const std::string place = fmt::format("{}:{}", file.string(), number);
    if (cells.size() != header.size())
      throw BadInput(fmt::format("{}: {} values, expected {}", place, cells.size(), header.size()));
    const double frame = number_in(cells[0], place, "frame");
    if (frame < 0 || frame > 1e9 || frame != std::floor(frame))
      throw BadInput(fmt::format("{}: frame is '{}', expected a whole number from 0", place, cells[0]));
    TipTrack::Row row;
    row.time_s = number_in(cells[1], place, "time_s");
    for (int axis = 0; axis < 3; ++axis) {
      const size_t column = static_cast<size_t>(axis) + 2;
      row.tip_mm[axis] = number_in(cells[column], place, expected[column]);
    }
    if (with_closed) {
      const double closed = number_in(cells[5], place, "closed");
      if (closed != 0 && closed != 1)
        throw BadInput(fmt::format("{}: closed is '{}', expected 0 or 1", place, cells[5]));
      row.closed = closed == 1;
    }
    if (!track.rows.emplace(static_cast<int>(frame), row).second)
      throw BadInput(fmt::format("{}: frame {} stands twice in the tip track", place, cells[0]));
  }
  if (track.rows.empty()) throw BadInput(fmt::format("{}: the tip track has no rows", file.string()));
  return track;
}

}  // namespace palpate
