#include "palpate/feedback/forces_file.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <map>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

constexpr const char* kHeader =
    "frame,time_s,status,in_contact,fx_N,fy_N,fz_N,force_N,mean_nodal_force_N,tip_x_mm,tip_y_mm,tip_z_mm,"
    "max_von_mises_kPa,residual,frame_ms,misfit_mm,warnings";

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

std::vector<std::string> split_line(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::string trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// One line of a table whose columns are known by name.
class LineReader {
 public:
  LineReader(const std::filesystem::path& file, const std::string& header_line) : file_(file) {
    const std::vector<std::string> names = split_line(header_line);
    for (size_t i = 0; i < names.size(); ++i) column_[trimmed(names[i])] = i;
  }

  bool has(const std::string& name) const { return column_.count(name) > 0; }

  void take(const std::string& text, int line) {
    fields_ = split_line(text);
    line_ = line;
    if (fields_.size() < column_.size())
      throw BadInput(
          fmt::format("{}, line {}: {} fields, expected {}", file_.string(), line_, fields_.size(), column_.size()));
  }

  std::string text(const std::string& name) const { return has(name) ? trimmed(fields_[column_.at(name)]) : ""; }

  double number(const std::string& name) const {
    if (!has(name)) return 0;
    const std::string field = text(name);
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size())
      throw BadInput(
          fmt::format("{}, line {}: column {} is \"{}\", expected a number", file_.string(), line_, name, field));
    return value;
  }

  Vec3 vector(const std::string& x, const std::string& y, const std::string& z) const {
    return {number(x), number(y), number(z)};
  }

 private:
  std::filesystem::path file_;
  std::map<std::string, size_t> column_;
  std::vector<std::string> fields_;
  int line_ = 0;
};

ForceRow parse_row(const LineReader& line) {
  ForceRow row;
  row.frame = static_cast<int>(line.number("frame"));
  row.time_s = line.number("time_s");
  row.status = line.text("status");
  row.in_contact = line.number("in_contact") > 0.5;
  row.force_N = line.vector("fx_N", "fy_N", "fz_N");
  row.force_magnitude_N = line.number("force_N");
  row.mean_nodal_force_N = line.number("mean_nodal_force_N");
  row.tip_mm = line.has("tip_x_mm") ? line.vector("tip_x_mm", "tip_y_mm", "tip_z_mm")
                                    : Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  row.max_von_mises_kPa = line.number("max_von_mises_kPa");
  row.residual = line.number("residual");
  row.frame_ms = line.number("frame_ms");
  row.misfit_mm = line.number("misfit_mm");
  row.warnings = line.text("warnings");
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
  if (status == FrameStatus::tool_lost) return row;

  row.tip_mm = estimate.tip_mm;
  row.residual = finite_or(estimate.residual, kUnboundedResidual);
  row.misfit_mm = finite_or(estimate.misfit_mm, 0);
  row.in_contact = status == FrameStatus::ok || status == FrameStatus::not_converged ||
                   (status == FrameStatus::map_stale && estimate.in_contact);
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
  stream_ << fmt::format(
      "{},{:.4f},{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{:.4f},{:.4f},{:.3e},{:.3f},{:.4f},{}\n",
      row.frame, row.time_s, row.status, row.in_contact ? 1 : 0, row.force_N.x(), row.force_N.y(), row.force_N.z(),
      row.force_magnitude_N, row.mean_nodal_force_N, row.tip_mm.x(), row.tip_mm.y(), row.tip_mm.z(),
      row.max_von_mises_kPa, row.residual, row.frame_ms, row.misfit_mm, row.warnings);
  stream_.flush();
  if (!stream_) throw Unfinished(fmt::format("cannot write {}: is the disk full?", file_.string()));
}

std::vector<ForceRow> read_forces(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string text;
  if (!stream || !std::getline(stream, text))
    throw BadInput(fmt::format("{}: cannot be read, expected a table of forces (CSV)", file.string()));
  LineReader line(file, text);
  for (const char* name : {"frame", "in_contact", "fx_N", "fy_N", "fz_N", "force_N"})
    if (!line.has(name)) throw BadInput(fmt::format("{}, line 1: column {} is missing", file.string(), name));

  std::vector<ForceRow> rows;
  for (int number = 2; std::getline(stream, text); ++number) {
    if (trimmed(text).empty() || text == "\r") continue;
    line.take(text, number);
    rows.push_back(parse_row(line));
  }
  return rows;
}

}  // namespace palpate
