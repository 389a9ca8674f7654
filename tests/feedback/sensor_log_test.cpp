#include "palpate/feedback/sensor_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

constexpr double kDelay_s = 12.34, kScale = 1.7;

/// A pull and a push in changing directions, 4 s long.
Vec3 force_N(double time_s) {
  if (time_s < 0.6 || time_s > 3.4) return Vec3::Zero();
  const double t = time_s - 0.6;
  return Vec3(std::sin(2.1 * t), 0.6 * std::sin(3.3 * t), -1.5 * std::sin(1.1 * t));
}

std::vector<ForceRow> video() {
  std::vector<ForceRow> rows;
  for (int frame = 0; frame < 100; ++frame) {
    ForceRow row;
    row.frame = frame;
    row.time_s = frame / 25.0;
    row.force_N = force_N(row.time_s);
    row.force_magnitude_N = row.force_N.norm();
    row.in_contact = row.force_magnitude_N > 0;
    rows.push_back(row);
  }
  return rows;
}

/// 100 Hz, its own clock and axes, a zero that is none, noise.
std::vector<SensorReading> log_of(const Mat3& sensor_from_camera, const Vec3& zero_N, double noise_N) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, noise_N);
  std::vector<SensorReading> log;
  for (int i = 0; i < 600; ++i) {
    const double video_s = i / 100.0 - 1;
    const Vec3 noise(normal(random), normal(random), normal(random));
    log.push_back({video_s + kDelay_s, sensor_from_camera * (kScale * force_N(video_s)) + zero_N + noise});
  }
  return log;
}

TEST(SensorLog, ItsClockAxesZeroAndScaleAreFound) {
  const Mat3 sensor_from_camera = Eigen::AngleAxisd(2.2, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  const Vec3 zero_N(0.4, -1.2, 9.3);
  const SensorComparison found = compare_with_sensor(video(), log_of(sensor_from_camera, zero_N, 0.02));
  EXPECT_NEAR(found.delay_s, kDelay_s, 0.01);
  EXPECT_NEAR(Eigen::AngleAxisd(found.camera_from_sensor * sensor_from_camera).angle(), 0, 0.03);
  EXPECT_NEAR((found.zero_N - zero_N).norm(), 0, 0.02);
  EXPECT_NEAR(found.scale, kScale, 0.01);
  EXPECT_LT(found.nrmse_scaled_pct, 3);
  EXPECT_GT(found.nrmse_pct, 15);
  EXPECT_GT(found.correlation, 0.99);
  EXPECT_EQ(found.frames, 100);
}

TEST(SensorLog, ReadsWhatAtisProgramsWriteAndSaysWhatIsMissing) {
  const std::filesystem::path file = testing::TempDir() + "sensor_log_test.csv";
  const auto write = [&file](const std::string& header, double step_s) {
    std::ofstream stream(file);
    stream << header << "\n";
    for (int i = 0; i < 20; ++i) stream << "ok," << i * step_s << ",1,2,3,0,0,0\n";
  };
  write("Status,Time,Fx,Fy,Fz,Tx,Ty,Tz", 0.01);
  const auto log = read_sensor_log(file);
  ASSERT_EQ(log.size(), 20U);
  EXPECT_EQ(log[3].force_N, Vec3(1, 2, 3));
  write("Status,Time,Fx,Fy,Force,Tx,Ty,Tz", 0.01);
  EXPECT_THAT([&] { read_sensor_log(file); },
              testing::ThrowsMessage<BadInput>(testing::HasSubstr("no column fz_N (or Fz)")));
  write("Status,Time,Fx,Fy,Fz,Tx,Ty,Tz", 0);
  EXPECT_THAT([&] { read_sensor_log(file); }, testing::ThrowsMessage<BadInput>(testing::HasSubstr(":3: time 0 after")));
  std::filesystem::remove(file);
}

TEST(SensorLog, AnEstimateWithoutForceOrALogOfAnotherTimeCannotBeCompared) {
  std::vector<ForceRow> nothing = video();
  for (ForceRow& row : nothing) row.force_N.setZero();
  const auto log = log_of(Mat3::Identity(), Vec3::Zero(), 0);
  EXPECT_THROW(compare_with_sensor(nothing, log), BadInput);
  EXPECT_THROW(compare_with_sensor(video(), {log.begin(), log.begin() + 50}), BadInput);
}

}  // namespace
}  // namespace palpate
