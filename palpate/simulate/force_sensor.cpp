#include "palpate/simulate/force_sensor.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "palpate/core/errors.h"
#include "palpate/simulate/noise.h"

namespace palpate {
namespace {

const double kBeyondVideo_s = 1;
const double kMaxZero_N = 2;
const double kLatestClock_s = 60;

/// Uniform in 0..1, by number.
double uniform(int seed, uint32_t number, uint32_t what) {
  return unit_from_bits(hash_bits(number, what, 23, static_cast<uint32_t>(seed)));
}

/// Normal with deviation 1 (Box and Muller 1958).
double normal(int seed, uint32_t number, uint32_t what) {
  const double a = std::max(1e-9, uniform(seed, number, what)), b = uniform(seed, number, what + 100);
  return std::sqrt(-2 * std::log(a)) * std::cos(2 * std::numbers::pi * b);
}

Vec3 force_at(const std::vector<TruthRow>& rows, double time_s) {
  const auto after = std::upper_bound(rows.begin(), rows.end(), time_s,
                                      [](double time, const TruthRow& row) { return time < row.time_s; });
  if (after == rows.begin()) return rows.front().force_N;
  if (after == rows.end()) return rows.back().force_N;
  const TruthRow& before = *(after - 1);
  const double t = (time_s - before.time_s) / (after->time_s - before.time_s);
  return (1 - t) * before.force_N + t * after->force_N;
}

std::string list(const Vec3& v) {
  return fmt::format("[{:.6f}, {:.6f}, {:.6f}]", v.x(), v.y(), v.z());
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  if (!stream.flush()) throw Unfinished(fmt::format("{}: cannot be written", file.string()));
}

}  // namespace

ForceSensor make_force_sensor(const Vec3& tool_axis, int seed) {
  ForceSensor sensor;
  sensor.clock_ahead_s = kLatestClock_s * uniform(seed, 0, 1);
  const auto turn = Eigen::AngleAxisd(2 * std::numbers::pi * uniform(seed, 0, 2), Vec3::UnitZ());
  sensor.camera_from_sensor = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), tool_axis) * turn.toRotationMatrix();
  for (uint32_t k = 0; k < 3; ++k) sensor.zero_N[k] = kMaxZero_N * (2 * uniform(seed, k, 3) - 1);
  return sensor;
}

std::vector<LoggedForce> log_of(const ForceSensor& sensor, const std::vector<TruthRow>& rows, int seed) {
  const double start_s = rows.front().time_s - kBeyondVideo_s;
  const double length_s = rows.back().time_s + kBeyondVideo_s - start_s;
  const auto count = static_cast<uint32_t>(length_s * sensor.rate_Hz);
  std::vector<LoggedForce> log;
  for (uint32_t i = 0; i < count; ++i) {
    // A third of the distance at most, so that time grows.
    const double step_s = 1 / sensor.rate_Hz;
    const double late_s = std::clamp(sensor.jitter_s * normal(seed, i, 4), -step_s / 3, step_s / 3);
    const double time_s = start_s + i * step_s + late_s;
    const Vec3 noise_N = sensor.noise_N * Vec3(normal(seed, i, 5), normal(seed, i, 6), normal(seed, i, 7));
    log.push_back({time_s + sensor.clock_ahead_s,
                   sensor.camera_from_sensor.transpose() * force_at(rows, time_s) + sensor.zero_N + noise_N});
  }
  return log;
}

void write_force_sensor(const std::filesystem::path& folder, const ForceSensor& sensor,
                        const std::vector<LoggedForce>& log) {
  std::string csv = "Status,Time,Fx,Fy,Fz\n";
  for (const LoggedForce& reading : log)
    csv += fmt::format("0,{:.5f},{:.4f},{:.4f},{:.4f}\n", reading.time_s, reading.force_N.x(), reading.force_N.y(),
                       reading.force_N.z());
  write_text(folder / "sensor.csv", csv);
  const Mat3& R = sensor.camera_from_sensor;
  write_text(
      folder / "sensor.yaml",
      fmt::format("# how sensor.csv came about: reading = R^T force + zero + noise, in left camera axes force = R "
                  "(reading - zero)\nrate_Hz: {:g}\nclock_ahead_s: {:.6f}\njitter_s: {:g}\ncamera_from_sensor: "
                  "[{}, {}, {}]\nzero_N: {}\nnoise_N: {:g}\n",
                  sensor.rate_Hz, sensor.clock_ahead_s, sensor.jitter_s, list(R.row(0)), list(R.row(1)), list(R.row(2)),
                  list(sensor.zero_N), sensor.noise_N));
}

}  // namespace palpate
