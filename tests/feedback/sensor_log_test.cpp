#include "palpate/feedback/sensor_log.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
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

class SensorLogFile : public ::testing::Test {
 protected:
  /// 4 s of the log at 100 Hz, a row by `row_of(number, seconds, force)`.
  template <class RowOf>
  std::vector<SensorReading> read(const std::string& before, RowOf row_of) const {
    std::ofstream stream(file_);
    stream << before << "\n";
    for (int i = 0; i < 600; ++i) stream << row_of(i, i / 100.0, Vec3(kScale * force_N(i / 100.0 - 1))) << "\n";
    stream.close();
    return read_sensor_log(file_, 4);
  }
  void expect_followed(const std::vector<SensorReading>& log) const {
    const SensorComparison found = compare_with_sensor(video(), log);
    EXPECT_NEAR(found.scale, kScale, 0.01);
    EXPECT_GT(found.correlation, 0.999);
    EXPECT_NEAR(log[1].time_s - log[0].time_s, 0.01, 1e-6);
  }
  std::string refusal(const std::string& text, double video_span_s = 4) const {
    std::ofstream(file_) << text;
    try {
      read_sensor_log(file_, video_span_s);
    } catch (const BadInput& error) {
      return error.what();
    }
    return "";
  }
  void TearDown() override { std::filesystem::remove(file_); }

  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() /
      (std::string("palpate_") + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
};

TEST_F(SensorLogFile, OfAtisNetFtHoldsCountsAndATimeOfDay) {
  const std::string before =
      "Start Time: 11/3/25 1:05 PM\nRDT Sample Rate: 100\nForce Units: N\nCounts per Unit Force: 1000000.0\n"
      "Status (hex), RDT Sequence, F/T Sequence, Fx, Fy, Fz, Tx, Ty, Tz, Time";
  const auto row = [](int i, double time_s, const Vec3& f) {
    return fmt::format(
        "\"0x00000000\",\"{}\",\"{}\",\"{:.0f}\",\"{:.0f}\",\"{:.0f}\",\"0\",\"0\",\"0\",\"11/3/25 1:05:{:06.3f} PM\"",
        i + 1, 4000 + 7 * i, 1e6 * f.x(), 1e6 * f.y(), 1e6 * f.z(), 7 + time_s);
  };
  expect_followed(read(before, row));
  // A rate that was stated and not kept does not count, its stamps do.
  std::string other_rate = before;
  other_rate.replace(other_rate.find("Rate: 100"), 9, "Rate: 7000");
  expect_followed(read(other_rate, row));
  // Without a time there is the rate alone.
  const std::vector<SensorReading> counted = read("Sample rate (Hz);100\nFx;Fy;Fz", [](int, double, const Vec3& f) {
    return fmt::format("{};{};{}", f.x(), f.y(), f.z());
  });
  expect_followed(counted);
}

TEST_F(SensorLogFile, OfAtisNetFtWithoutItsCountsPerForceIsRefused) {
  const auto row = [](const char* format) {
    return [format](int i, double time_s, const Vec3& f) {
      return fmt::format(fmt::runtime(format), 4000 + 7 * i, f.x() * 1e6, f.y() * 1e6, f.z() * 1e6, time_s);
    };
  };
  const char* header = "RDT Sample Rate: 100\nForce Units: N\nRDT Sequence, Fx, Fy, Fz, Time";
  EXPECT_THAT([&] { read(header, row("{},{:.0f},{:.0f},{:.0f},{}")); },
              testing::ThrowsMessage<BadInput>(testing::AllOf(testing::HasSubstr("fx_N is '0' beside an RDT Sequence"),
                                                              testing::HasSubstr("Counts per Unit Force"),
                                                              testing::HasSubstr("the header in line 3"))));
  EXPECT_EQ(read(header, row("{},{:.3f},{:.3f},{:.3f},{}")).size(), 600U);
  EXPECT_EQ(read("RDT Sequence, Fx (N), Fy (N), Fz (N), Time", row("{},{:.0f},{:.0f},{:.0f},{}")).size(), 600U);
}

TEST_F(SensorLogFile, OfCountsIsDividedWhereTwoRowsOfOneTimeAreAveraged) {
  std::string text = "Counts per Unit Force: 1000\nTime (s), Fx, Fy, Fz\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{},1000,0,0\n{},1001,0,0\n", 0.02 * i, 0.02 * i);
  std::ofstream(file_) << text;
  EXPECT_NEAR(read_sensor_log(file_).front().force_N.x(), 1.0005, 1e-9);
}

TEST_F(SensorLogFile, OfALoggerThatWritesWholeSecondsOrMsBehindAColonIsFollowed) {
  expect_followed(read("Time,Fx,Fy,Fz", [](int i, double, const Vec3& f) {
    return fmt::format("13:53:{:02}:{:03},{},{},{}", 20 + i / 100, 10 * (i % 100), f.x(), f.y(), f.z());
  }));
  expect_followed(read("Time,Fx,Fy,Fz", [](int i, double, const Vec3& f) {
    return fmt::format("13:53:{:02},{},{},{}", 20 + i / 100, f.x(), f.y(), f.z());
  }));
}

TEST_F(SensorLogFile, OfARobotOrOfALoggerWithItsOwnClock) {
  expect_followed(
      read("%time,field.header.seq,field.header.stamp,field.header.frame_id,field.wrench.force.x,field.wrench.force.y,"
           "field.wrench.force.z",
           [](int i, double time_s, const Vec3& f) {
             const auto ns = 1700000000000000000LL + std::llround(time_s * 1e9);
             return fmt::format("{},{},{},base,{},{},{}", ns + 12345, i, ns, f.x(), f.y(), f.z());
           }));
  expect_followed(read("Time (ms);Kraft X;Kraft Y;Kraft Z", [](int, double time_s, const Vec3& f) {
    std::string row = fmt::format("{:.3f};{:.6f};{:.6f};{:.6f}", 1000 * time_s, f.x(), f.y(), f.z());
    std::replace(row.begin(), row.end(), '.', ',');
    return row;
  }));
  expect_followed(read("Time\tFx (mN)\tFy (mN)\tFz (mN)", [](int i, double, const Vec3& f) {
    return fmt::format("{}\t{}\t{}\t{}", 10 * i, 1000 * f.x(), 1000 * f.y(), 1000 * f.z());
  }));
}

TEST_F(SensorLogFile, MeansRowsOfOneTimeAndRefusesTimeThatRunsBackwards) {
  std::string text = "Time,Fx,Fy,Fz\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{},1,2,3\n{},3,2,{}\n", 0.02 * i, 0.02 * i, i);
  std::ofstream(file_) << text;
  const auto log = read_sensor_log(file_);
  ASSERT_EQ(log.size(), 20U);
  EXPECT_EQ(log[5].force_N, Vec3(2, 2, 4));
  EXPECT_THAT(refusal(text + "0.1,1,2,3\n", 0), testing::HasSubstr(":42: time 0.1 s after 0.38 s"));
}

TEST_F(SensorLogFile, SaysWhatIsMissing) {
  EXPECT_THAT(refusal("Status,Time,Fx,Fy,Force\nok,0,1,2,3\n"),
              testing::AllOf(testing::HasSubstr("no column fz_N"), testing::HasSubstr("Status,Time,Fx,Fy,Force")));
  EXPECT_THAT(refusal("Time,Fx,Fy,Fz\n0,1,2,3\n"), testing::HasSubstr("expected at least 10"));
  std::string short_log = "Time,Fx,Fy,Fz\n";
  for (int i = 0; i < 20; ++i) short_log += fmt::format("{},{},2,3\n", 0.01 * i, i);
  std::ofstream(file_) << short_log;
  EXPECT_THAT([&] { compare_with_log(video(), file_); },
              testing::ThrowsMessage<BadInput>(testing::HasSubstr(file_.string())));
}

TEST(SensorLog, OfAnotherRecordingIsRefused) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0, 1);
  std::vector<SensorReading> log;
  for (int i = 0; i < 2000; ++i) log.push_back({i / 100.0, Vec3(normal(random), normal(random), normal(random))});
  EXPECT_THAT([&] { compare_with_sensor(video(), log); },
              testing::ThrowsMessage<BadInput>(testing::HasSubstr("does not follow the estimate")));
}

TEST(SensorLog, ThatFollowsOnlyWithAFactorOfNearlyZeroIsRefused) {
  std::vector<SensorReading> log = log_of(Mat3::Identity(), Vec3::Zero(), 0);
  for (SensorReading& reading : log) reading.force_N *= 1e-4;
  EXPECT_THAT([&] { compare_with_sensor(video(), log); },
              testing::ThrowsMessage<BadInput>(testing::HasSubstr("has to be multiplied by 0.00017")));
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
