#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "palpate/feedback/sensor_log.h"
#include "palpate/simulate/force_sensor.h"
#include "tests/app/program.h"

namespace palpate::test {
namespace {

/// A force that turns while it grows and fades, free before and after.
std::vector<TruthRow> truth() {
  std::vector<TruthRow> rows;
  for (int frame = 0; frame < 100; ++frame) {
    TruthRow row;
    row.frame = frame;
    row.time_s = frame / 25.0;
    row.in_contact = frame >= 20 && frame < 80;
    const double t = row.time_s - 0.8;
    if (row.in_contact) row.force_N = 4 * std::sin(1.3 * t) * Vec3(std::cos(t), std::sin(2 * t), 0.4);
    rows.push_back(row);
  }
  return rows;
}

std::vector<ForceRow> estimate(double factor) {
  std::vector<ForceRow> rows;
  for (const TruthRow& row : truth()) {
    ForceRow estimated;
    estimated.frame = row.frame;
    estimated.time_s = row.time_s;
    estimated.in_contact = row.in_contact;
    estimated.force_N = factor * row.force_N;
    estimated.force_magnitude_N = estimated.force_N.norm();
    rows.push_back(estimated);
  }
  return rows;
}

TEST(ForceSensor, WhatItsLogHidesIsFoundAgain) {
  const Workspace folder;
  const ForceSensor sensor = make_force_sensor(Vec3(1, -2, 3).normalized(), 5);
  EXPECT_NEAR((sensor.camera_from_sensor.col(2) - Vec3(1, -2, 3).normalized()).norm(), 0, 1e-12);
  EXPECT_NEAR(sensor.camera_from_sensor.determinant(), 1, 1e-12);
  write_force_sensor(folder / "", sensor, log_of(sensor, truth(), 5));
  const auto log = read_sensor_log(folder / "sensor.csv");
  EXPECT_NEAR(static_cast<double>(log.size()), 596, 2);
  const SensorComparison found = compare_with_sensor(estimate(0.5), log);
  EXPECT_NEAR(found.delay_s, sensor.clock_ahead_s, 0.006);
  EXPECT_NEAR(Eigen::AngleAxisd(found.camera_from_sensor.transpose() * sensor.camera_from_sensor).angle(), 0, 0.02);
  EXPECT_NEAR((found.zero_N - sensor.zero_N).norm(), 0, 0.02);
  EXPECT_NEAR(found.scale, 2, 0.02);
  EXPECT_NEAR(found.correlation, 1, 0.002);
  EXPECT_LT(found.nrmse_scaled_pct, 2);
  for (const SensorReading& reading : aligned(log, found))
    EXPECT_TRUE(reading.time_s > 0.7 || reading.force_N.norm() < 0.15);
}

TEST(ForceSensor, ItsLogIsTheSameForTheSameSeedOnly) {
  const auto first_reading = [](int seed) {
    return log_of(make_force_sensor(Vec3::UnitZ(), seed), truth(), seed).front();
  };
  EXPECT_EQ(first_reading(3).force_N, first_reading(3).force_N);
  EXPECT_NE(first_reading(3).time_s, first_reading(4).time_s);
}

}  // namespace
}  // namespace palpate::test
