#include "palpate/feedback/sensor_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/kabsch.h"
#include "palpate/core/table.h"
#include "palpate/core/table_text.h"
#include "palpate/core/time_column.h"
#include "palpate/core/units.h"
#include "palpate/feedback/clock_search.h"

namespace palpate {

namespace {

constexpr size_t kMinReadings = 10;
/// The delay is searched in steps of the coarse one everywhere, around the best of those in steps of the fine one.
constexpr double kCoarseStep_s = 0.02, kFineStep_s = 0.005;
constexpr int kFineSteps = 6;
/// Of the frames, as many have to lie within the sensor's time.
constexpr double kMinOverlap = 0.5;
/// Below, the log shows something else than the video.
constexpr double kMinCorrelation = 0.5;
/// A smaller factor between sensor and estimate was found in the noise of a sensor that nothing touches.
constexpr double kMinScale = 1e-3;
/// A rate that the file states and its stamps differ by no more than this, or the stamps hold.
constexpr double kRateTolerance = 0.02;

std::vector<TableColumn> sensor_columns() {
  std::vector<TableColumn> columns = time_columns();
  columns.push_back({"fx_N", {"fx", "force.x", "forcex", "forces.x", "f.x", "xforce", "kraftx", "f0"}});
  columns.push_back({"fy_N", {"fy", "force.y", "forcey", "forces.y", "f.y", "yforce", "krafty", "f1"}});
  columns.push_back({"fz_N", {"fz", "force.z", "forcez", "forces.z", "f.z", "zforce", "kraftz", "f2"}});
  columns.push_back({"sequence", {"rdtsequence"}});
  return columns;
}

/// Of all rows, before those of one time are averaged.
bool are_whole_numbers(const Table& table) {
  bool any = false;
  for (const Table::Row& row : table.rows())
    for (const char* column : {"fx_N", "fy_N", "fz_N"}) {
      const double value = table.number(row, column);
      if (std::isfinite(value) && value != std::round(value)) return false;
      any = any || (std::isfinite(value) && value != 0);
    }
  return any;
}

/// ATI's Net F/T: counts for each N, and the unit behind them, stand before the table. Throws BadInput where the values
/// are counts and how many are a newton is not said.
double newtons_per_value(const Table& table) {
  const bool is_whole = are_whole_numbers(table);
  double factor = 1;
  if (const auto name = table.before_header({"force", "unit"}); name && table.stated_unit("fx_N").empty())
    if (const auto unit = unit_of(*name); unit && unit->kind == Unit::Kind::force) factor = unit->factor;
  const auto counts = table.before_header({"count", "force"});
  const double per_unit = counts ? number_of(*counts) : 0;
  if (is_whole && table.has("sequence") && table.stated_unit("fx_N").empty() && !(per_unit > 0))
    throw BadInput(fmt::format(
        "{}:{}: fx_N is '{}' beside an RDT Sequence, and all forces are whole numbers: counts of a Net F/T; "
        "expected a line 'Counts per Unit Force: 1000000' before the header, with the sensor's own number; "
        "{}",
        table.file().string(), table.rows().front().line, table.text(table.rows().front(), "fx_N"),
        table.header_found()));
  if (is_whole && per_unit > 0) factor /= per_unit;
  return factor;
}

std::optional<double> stated_rate_Hz(const Table& table) {
  const auto text = table.before_header({"rate"});
  const double rate_Hz = text ? number_of(text->substr(0, text->find_first_not_of("0123456789.eE+"))) : 0;
  return rate_Hz > 0 ? std::optional(rate_Hz) : std::nullopt;
}

/// By the sensor's own count of its samples where the file states their rate, and the stamps, which the computer puts
/// on them as they come in, do not say otherwise.
std::vector<double> clock_of(const Table& table, double video_span_s) {
  const std::optional<double> rate_Hz = stated_rate_Hz(table);
  const bool has_stamps = table.has("time_s") || table.has("stamp.secs");
  std::vector<double> stamps_s;
  if (has_stamps || !rate_Hz) stamps_s = times_s(table, {video_span_s});
  if (!rate_Hz || table.rows().size() < kMinReadings) return stamps_s;
  std::vector<double> counted_s;
  for (const Table::Row& row : table.rows())
    counted_s.push_back(
        (table.has("sequence") ? table.number(row, "sequence") : static_cast<double>(counted_s.size())) / *rate_Hz);
  if (stamps_s.empty()) return counted_s;
  const double stamped = stamps_s.back() - stamps_s.front(), counted = counted_s.back() - counted_s.front();
  if (!(std::abs(stamped - counted) <= kRateTolerance * stamped)) return stamps_s;
  const double shift_s = stamps_s.front() - counted_s.front();
  for (double& time_s : counted_s) time_s += shift_s;
  return counted_s;
}

/// Between the readings; empty outside them.
std::optional<Vec3> force_at(const std::vector<SensorReading>& sensor, double time_s) {
  const auto after = std::upper_bound(sensor.begin(), sensor.end(), time_s,
                                      [](double time, const SensorReading& reading) { return time < reading.time_s; });
  if (after == sensor.begin() || after == sensor.end()) return std::nullopt;
  const SensorReading &a = *(after - 1), &b = *after;
  const double t = (time_s - a.time_s) / (b.time_s - a.time_s);
  return Vec3((1 - t) * a.force_N + t * b.force_N);
}

/// Frames that both know, with the sensor's force less its zero.
struct Pairs {
  std::vector<Vec3> estimate_N, sensor_N;
  Vec3 zero_N = Vec3::Zero();
};

Pairs pairs_at(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor, double delay_s) {
  Pairs pairs;
  int free_frames = 0;
  for (const ForceRow& row : estimate) {
    const auto force = force_at(sensor, row.time_s + delay_s);
    if (!force) continue;
    pairs.estimate_N.push_back(row.force_N);
    pairs.sensor_N.push_back(*force);
    if (row.in_contact) continue;
    pairs.zero_N += *force;
    ++free_frames;
  }
  if (free_frames > 0) pairs.zero_N /= free_frames;
  for (Vec3& force : pairs.sensor_N) force -= pairs.zero_N;
  return pairs;
}

double correlation_of(const Pairs& pairs) {
  const auto n = static_cast<double>(pairs.estimate_N.size());
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (size_t i = 0; i < pairs.estimate_N.size(); ++i) {
    const double x = pairs.estimate_N[i].norm(), y = pairs.sensor_N[i].norm();
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  const double spread = (n * aa - a * a) * (n * bb - b * b);
  return spread > 0 ? (n * ab - a * b) / std::sqrt(spread) : 0;
}

double best_delay_s(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor) {
  double best = 0, best_correlation = -2;
  for (const double around_s : likely_delays_s(estimate, sensor, kMinOverlap, kCoarseStep_s))
    for (int step = -kFineSteps; step <= kFineSteps; ++step) {
      const double delay_s = around_s + step * kFineStep_s;
      const Pairs pairs = pairs_at(estimate, sensor, delay_s);
      if (static_cast<double>(pairs.estimate_N.size()) < kMinOverlap * static_cast<double>(estimate.size())) continue;
      const double correlation = correlation_of(pairs);
      if (correlation <= best_correlation) continue;
      best_correlation = correlation;
      best = delay_s;
    }
  if (best_correlation <= -2)
    throw BadInput(
        fmt::format("the sensor's log lasts {:g} s and covers less than half of the {:g} s of video at any delay",
                    sensor.back().time_s - sensor.front().time_s, estimate.back().time_s - estimate.front().time_s));
  return best;
}

}  // namespace

std::vector<SensorReading> read_sensor_log(const std::filesystem::path& file, double video_span_s) {
  const Table table(file, sensor_columns());
  table.require({"fx_N", "fy_N", "fz_N"});
  const std::vector<double> times = clock_of(table, video_span_s);
  std::vector<SensorReading> readings;
  int of_same_time = 1;
  for (size_t i = 0; i < times.size(); ++i) {
    const Table::Row& row = table.rows()[i];
    const SensorReading reading{times[i],
                                {table.number(row, "fx_N"), table.number(row, "fy_N"), table.number(row, "fz_N")}};
    if (!std::isfinite(reading.time_s) || !reading.force_N.allFinite()) continue;
    if (!readings.empty() && reading.time_s < readings.back().time_s)
      throw BadInput(fmt::format("{}:{}: time {:.15g} s after {:.15g} s, expected time that grows; {}", file.string(),
                                 row.line, reading.time_s, readings.back().time_s, table.header_found()));
    if (!readings.empty() && reading.time_s == readings.back().time_s) {
      ++of_same_time;
      readings.back().force_N += (reading.force_N - readings.back().force_N) / of_same_time;
      continue;
    }
    of_same_time = 1;
    readings.push_back(reading);
  }
  if (readings.size() < kMinReadings)
    throw BadInput(fmt::format("{}: {} rows with a time of their own and three forces, expected at least {}; {}",
                               file.string(), readings.size(), kMinReadings, table.header_found()));
  const double factor = newtons_per_value(table);
  for (SensorReading& reading : readings) reading.force_N *= factor;
  return readings;
}

SensorComparison compare_with_sensor(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor) {
  const auto has_force = [](const ForceRow& row) { return row.force_N.norm() > 0; };
  if (std::none_of(estimate.begin(), estimate.end(), has_force))
    throw BadInput("the estimate has no force in any frame: nothing to align a sensor with");
  SensorComparison result;
  result.delay_s = best_delay_s(estimate, sensor);
  const Pairs pairs = pairs_at(estimate, sensor, result.delay_s);
  result.zero_N = pairs.zero_N;
  result.camera_from_sensor = rotation_onto(pairs.sensor_N, pairs.estimate_N);
  result.frames = static_cast<int>(pairs.estimate_N.size());
  result.correlation = correlation_of(pairs);
  if (result.correlation < kMinCorrelation)
    throw BadInput(
        fmt::format("the sensor's log does not follow the estimate at any delay: the best is {:+.3f} s with a "
                    "correlation of {:.2f}, expected at least {:g}; is it the log of this recording?",
                    result.delay_s, result.correlation, kMinCorrelation));
  double along = 0, squared = 0;
  for (size_t i = 0; i < pairs.estimate_N.size(); ++i) {
    along += pairs.estimate_N[i].dot(result.camera_from_sensor * pairs.sensor_N[i]);
    squared += pairs.estimate_N[i].squaredNorm();
    result.sensor_peak_N = std::max(result.sensor_peak_N, pairs.sensor_N[i].norm());
  }
  if (result.sensor_peak_N <= 0) throw BadInput("the sensor's log shows no force");
  result.scale = along / squared;
  if (!(result.scale >= kMinScale))
    throw BadInput(
        fmt::format("the sensor's log follows the estimate best at {:+.3f} s, where it shows no more than {:.3g} N and "
                    "the estimate has to be multiplied by {:.2g}, expected a factor of at least {:g}; is it the log of "
                    "this recording, and in N?",
                    result.delay_s, result.sensor_peak_N, result.scale, kMinScale));
  for (size_t i = 0; i < pairs.estimate_N.size(); ++i) {
    const Vec3 turned = result.camera_from_sensor * pairs.sensor_N[i];
    result.rmse_N += (pairs.estimate_N[i] - turned).squaredNorm();
    result.rmse_scaled_N += (result.scale * pairs.estimate_N[i] - turned).squaredNorm();
  }
  result.rmse_N = std::sqrt(result.rmse_N / result.frames);
  result.rmse_scaled_N = std::sqrt(result.rmse_scaled_N / result.frames);
  result.nrmse_pct = 100 * result.rmse_N / result.sensor_peak_N;
  result.nrmse_scaled_pct = 100 * result.rmse_scaled_N / result.sensor_peak_N;
  return result;
}

SensorComparison compare_with_log(const std::vector<ForceRow>& estimate, const std::filesystem::path& log) {
  const double span_s = estimate.empty() ? 0 : estimate.back().time_s - estimate.front().time_s;
  const std::vector<SensorReading> readings = read_sensor_log(log, span_s);
  try {
    return compare_with_sensor(estimate, readings);
  } catch (const BadInput& error) {
    throw BadInput(fmt::format("{}: {}", log.string(), error.what()));
  }
}

std::vector<SensorReading> aligned(const std::vector<SensorReading>& sensor, const SensorComparison& found) {
  std::vector<SensorReading> readings;
  for (const SensorReading& reading : sensor)
    readings.push_back({reading.time_s - found.delay_s, found.camera_from_sensor * (reading.force_N - found.zero_N)});
  return readings;
}

std::string to_text(const SensorComparison& found) {
  return fmt::format(
      "sensor's clock        {:+.3f} s against the video's, found by correlation\n"
      "force RMSE            {:.3f} N, {:.1f} % of the sensor's peak of {:.2f} N\n"
      "after one factor      {:.3f} N, {:.1f} %, with the estimate times {:.3f}\n"
      "correlation           {:.4f} over {} frames\n",
      found.delay_s, found.rmse_N, found.nrmse_pct, found.sensor_peak_N, found.rmse_scaled_N, found.nrmse_scaled_pct,
      found.scale, found.correlation, found.frames);
}

std::string to_json(const SensorComparison& found) {
  nlohmann::ordered_json axes = nlohmann::ordered_json::array();
  for (int row = 0; row < 3; ++row)
    axes.push_back(
        {found.camera_from_sensor(row, 0), found.camera_from_sensor(row, 1), found.camera_from_sensor(row, 2)});
  const nlohmann::ordered_json json = {{"frames", found.frames},
                                       {"delay_s", found.delay_s},
                                       {"camera_from_sensor", axes},
                                       {"sensor_peak_N", found.sensor_peak_N},
                                       {"force_rmse_N", found.rmse_N},
                                       {"force_nrmse_pct", found.nrmse_pct},
                                       {"scale", found.scale},
                                       {"force_rmse_scaled_N", found.rmse_scaled_N},
                                       {"force_nrmse_scaled_pct", found.nrmse_scaled_pct},
                                       {"force_correlation", found.correlation}};
  return json.dump(1) + "\n";
}

}  // namespace palpate
