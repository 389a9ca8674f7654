#include "palpate/feedback/sensor_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/kabsch.h"
#include "palpate/feedback/csv_table.h"

namespace palpate {

namespace {

constexpr size_t kFewestReadings = 10;
/// The delay is searched in steps of this.
constexpr double kDelayStep_s = 0.005;
/// Of the frames, as many have to lie within the sensor's time.
constexpr double kLeastOverlap = 0.5;

std::string column_of(const CsvTable& table, const std::filesystem::path& file,
                      const std::array<std::string, 2>& names) {
  for (const std::string& name : names)
    if (table.has(name)) return name;
  throw BadInput(fmt::format("{}: no column {} (or {})", file.string(), names[0], names[1]));
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
  const double first = sensor.front().time_s - estimate.back().time_s,
               last = sensor.back().time_s - estimate.front().time_s;
  double best = 0, best_correlation = -2;
  for (double delay_s = first; delay_s <= last; delay_s += kDelayStep_s) {
    const Pairs pairs = pairs_at(estimate, sensor, delay_s);
    if (static_cast<double>(pairs.estimate_N.size()) < kLeastOverlap * static_cast<double>(estimate.size())) continue;
    const double correlation = correlation_of(pairs);
    if (correlation <= best_correlation) continue;
    best_correlation = correlation;
    best = delay_s;
  }
  if (best_correlation <= -2)
    throw BadInput("the sensor's log and the estimate overlap by less than half of the video at any delay");
  return best;
}

}  // namespace

std::vector<SensorReading> read_sensor_log(const std::filesystem::path& file) {
  const CsvTable table(file);
  const std::string time = column_of(table, file, {"time_s", "Time"});
  const std::array<std::string, 3> force = {column_of(table, file, {"fx_N", "Fx"}),
                                            column_of(table, file, {"fy_N", "Fy"}),
                                            column_of(table, file, {"fz_N", "Fz"})};
  std::vector<SensorReading> readings;
  for (const CsvTable::Row& row : table.rows()) {
    SensorReading reading{table.number(row, time),
                          {table.number(row, force[0]), table.number(row, force[1]), table.number(row, force[2])}};
    if (!std::isfinite(reading.time_s) || !reading.force_N.allFinite()) continue;
    if (!readings.empty() && reading.time_s <= readings.back().time_s)
      throw BadInput(fmt::format("{}:{}: time {} after {}, expected time that grows", file.string(), row.line,
                                 reading.time_s, readings.back().time_s));
    readings.push_back(reading);
  }
  if (readings.size() < kFewestReadings)
    throw BadInput(fmt::format("{}: {} rows with a time and three forces, expected at least {}", file.string(),
                               readings.size(), kFewestReadings));
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
  double along = 0, squared = 0;
  for (size_t i = 0; i < pairs.estimate_N.size(); ++i) {
    along += pairs.estimate_N[i].dot(result.camera_from_sensor * pairs.sensor_N[i]);
    squared += pairs.estimate_N[i].squaredNorm();
    result.sensor_peak_N = std::max(result.sensor_peak_N, pairs.sensor_N[i].norm());
  }
  if (result.sensor_peak_N <= 0) throw BadInput("the sensor's log shows no force");
  result.scale = along / squared;
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
