#include "palpate/feedback/forces_file.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/core/table.h"

namespace palpate {
namespace {

constexpr const char* kHeader =
    "frame,time_s,status,in_contact,fx_N,fy_N,fz_N,force_N,mean_nodal_force_N,tip_x_mm,tip_y_mm,tip_z_mm,"
    "max_von_mises_kPa,residual,frame_ms,misfit_mm,warnings,force_low_N,force_high_N,force_low_total_N,"
    "force_high_total_N,grip,p_contact,footprint_mm,scene_x_mm,scene_y_mm,scene_z_mm";

std::vector<TableColumn> forces_columns() {
  std::vector<TableColumn> columns;
  std::stringstream names(std::string(kHeader) + ",visible");
  for (std::string name; std::getline(names, name, ',');) columns.push_back({name});
  return columns;
}

/// Written for a residual that is not finite: far above every tolerance, still a number.
constexpr double kUnboundedResidual = 1e6;

double finite_or(double value, double otherwise) {
  return std::isfinite(value) ? value : otherwise;
}

FrameStatus honest_status(const ForceEstimate& estimate) {
  if (estimate.status == FrameStatus::tool_lost || !estimate.tip_mm.allFinite()) return FrameStatus::tool_lost;
  if (estimate.status == FrameStatus::no_contact) return FrameStatus::no_contact;
  if (!estimate.force_N.allFinite()) return FrameStatus::not_converged;
  return estimate.status;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ";") + word;
  return text;
}

/// Frames are numbered; a row without its number belongs to none.
int frame_of(const Table& table, const Table::Row& row, const std::filesystem::path& file) {
  const double frame = table.number(row, "frame");
  if (!(std::abs(frame) < std::numeric_limits<int>::max()))
    throw BadInput(fmt::format("{}, line {}: column frame is \"{}\", expected a number; {}", file.string(), row.line,
                               table.text(row, "frame"), table.header_found()));
  return static_cast<int>(frame);
}

ForceRow parse_row(const Table& table, const Table::Row& line, const std::filesystem::path& file) {
  const auto number = [&](const char* column) { return table.number(line, column); };
  const auto vector = [&](const char* x, const char* y, const char* z) {
    return Vec3(number(x), number(y), number(z));
  };
  ForceRow row;
  row.frame = frame_of(table, line, file);
  row.line = line.line;
  row.time_s = finite_or(number("time_s"), 0);
  row.status = table.text(line, "status");
  row.in_contact = number("in_contact") > 0.5;
  row.force_N = vector("fx_N", "fy_N", "fz_N");
  row.force_magnitude_N = number("force_N");
  row.mean_nodal_force_N = finite_or(number("mean_nodal_force_N"), 0);
  row.tip_mm = vector("tip_x_mm", "tip_y_mm", "tip_z_mm");
  row.max_von_mises_kPa = finite_or(number("max_von_mises_kPa"), 0);
  row.residual = finite_or(number("residual"), 0);
  row.frame_ms = finite_or(number("frame_ms"), 0);
  row.misfit_mm = finite_or(number("misfit_mm"), 0);
  row.warnings = table.text(line, "warnings");
  row.force_low_N = number("force_low_N");
  row.force_high_N = number("force_high_N");
  row.force_low_total_N = finite_or(number("force_low_total_N"), 0);
  row.force_high_total_N = finite_or(number("force_high_total_N"), 0);
  if (const std::string grip = table.text(line, "grip"); !grip.empty()) row.grip = grip;
  row.p_contact = finite_or(number("p_contact"), 0);
  row.footprint_mm = finite_or(number("footprint_mm"), 0);
  row.scene_mm = vector("scene_x_mm", "scene_y_mm", "scene_z_mm");
  if (!row.scene_mm.allFinite()) row.scene_mm.setZero();
  return row;
}

}  // namespace

ForceRow to_row(const ForceEstimate& estimate) {
  const FrameStatus status = honest_status(estimate);
  ForceRow row;
  row.frame = estimate.frame;
  row.time_s = finite_or(estimate.time_s, 0);
  row.status = status_name(status);
  row.frame_ms = finite_or(estimate.times.total_ms(), 0);
  row.warnings = joined(estimate.warnings);
  row.force_low_N = row.force_high_N = 0;
  row.scene_mm = estimate.scene_mm.allFinite() ? estimate.scene_mm : Vec3::Zero();
  if (status == FrameStatus::tool_lost) return row;

  row.tip_mm = estimate.tip_mm;
  row.residual = finite_or(estimate.residual, kUnboundedResidual);
  row.misfit_mm = finite_or(estimate.misfit_mm, 0);
  row.in_contact = status == FrameStatus::ok || status == FrameStatus::not_converged ||
                   (status == FrameStatus::map_stale && estimate.in_contact);
  row.footprint_mm = finite_or(estimate.footprint_mm, 0);
  row.p_contact = finite_or(estimate.p_contact, 0);
  if (row.in_contact) row.grip = hold_name(estimate.grip);
  row.force_low_N = finite_or(estimate.band.low_N, 0);
  row.force_high_N = finite_or(estimate.band.high_N, 0);
  row.force_low_total_N = finite_or(estimate.total_band.low_N, 0);
  row.force_high_total_N = finite_or(estimate.total_band.high_N, 0);
  if (status == FrameStatus::no_contact || status == FrameStatus::not_converged) return row;

  row.force_N = estimate.force_N;
  row.force_magnitude_N = estimate.force_N.norm();
  row.mean_nodal_force_N = finite_or(estimate.mean_nodal_force_N, 0);
  row.max_von_mises_kPa = finite_or(estimate.max_von_mises_kPa, 0);
  return row;
}

ForcesWriter::ForcesWriter(const std::filesystem::path& file) : file_(file), stream_(file) {
  stream_ << kHeader << std::endl;
  if (!stream_) throw Unfinished(fmt::format("cannot write {}", file_.string()));
}

void ForcesWriter::write(const ForceEstimate& estimate) {
  write(to_row(estimate));
}

void ForcesWriter::write(const ForceRow& row) {
  const auto whole_rows_bytes = static_cast<std::uintmax_t>(stream_.tellp());
  stream_ << fmt::format(
      "{},{:.4f},{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{:.4f},{:.4f},{:.3e},{:.3f},{:.4f},{},"
      "{:.6f},{:.6f},{:.6f},{:.6f},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n",
      row.frame, row.time_s, row.status, row.in_contact ? 1 : 0, row.force_N.x(), row.force_N.y(), row.force_N.z(),
      row.force_magnitude_N, row.mean_nodal_force_N, row.tip_mm.x(), row.tip_mm.y(), row.tip_mm.z(),
      row.max_von_mises_kPa, row.residual, row.frame_ms, row.misfit_mm, row.warnings, row.force_low_N, row.force_high_N,
      row.force_low_total_N, row.force_high_total_N, row.grip, row.p_contact, row.footprint_mm, row.scene_mm.x(),
      row.scene_mm.y(), row.scene_mm.z());
  stream_.flush();
  if (!stream_) {
    stream_.close();
    std::error_code ignored;  // half a row would be read as one
    std::filesystem::resize_file(file_, whole_rows_bytes, ignored);
    throw Unfinished(fmt::format("cannot write {}: is the disk full?", file_.string()));
  }
}

SecondForcesWriter::SecondForcesWriter(const std::filesystem::path& file) : file_(file) {
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
}

void SecondForcesWriter::write(const ForceEstimate& estimate) {
  if (estimate.further.empty()) return;
  rows_.push_back(to_row(estimate.further.front()));
  if (writer_) return writer_->write(rows_.back());
  if (rows_.back().status == "tool_lost") return;
  writer_.emplace(file_);
  for (const ForceRow& row : rows_) writer_->write(row);
}

std::vector<ForceRow> read_forces(const std::filesystem::path& file) {
  const Table table(file, forces_columns());
  table.require({"frame", "force_N"});
  std::vector<ForceRow> rows;
  for (const Table::Row& row : table.rows()) rows.push_back(parse_row(table, row, file));
  return rows;
}

std::vector<ForceRow> read_truth(const std::filesystem::path& file) {
  std::vector<ForceRow> rows = read_forces(file);
  if (rows.empty())
    throw BadInput(fmt::format("{}: holds no frame, expected at least one row of truth", file.string()));
  for (const ForceRow& row : rows)
    if (!std::isfinite(row.force_magnitude_N))
      throw BadInput(fmt::format("{}: force_N of frame {} is no finite number, expected the true force in N",
                                 file.string(), row.frame));
  return rows;
}

}  // namespace palpate
