#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/feedback/forces_file.h"

namespace palpate {

/// What a force sensor under the organ or in the tool wrote, in its own time and axes.
struct SensorReading {
  double time_s = 0;
  Vec3 force_N = Vec3::Zero();
};

/// A table with a time and fx, fy, fz as sensors' programs write it (`Table`): ours, ATI's with counts and rate before
/// the table, rostopic's and a robot's (`field.wrench.force.x`). `video_span_s` helps to tell the unit of its time; 0 =
/// not known. Rows of the same time are averaged. Throws BadInput where a column is missing, fewer than ten rows have
/// numbers, the unit of the time cannot be told, the time runs backwards, or ATI's counts lack their factor.
std::vector<SensorReading> read_sensor_log(const std::filesystem::path& file, double video_span_s = 0);

/// How an estimate compares with a sensor whose clock and axes are not known: clock by the delay at which the
/// magnitudes agree best, axes by the rotation that turns its forces onto the estimated ones (Kabsch 1976), zero by its
/// mean where the estimate has no contact.
struct SensorComparison {
  double delay_s = 0;  ///< sensor time minus video time
  Mat3 camera_from_sensor = Mat3::Identity();
  Vec3 zero_N = Vec3::Zero();  ///< sensor's, in its axes
  int frames = 0;              ///< that both cover
  double sensor_peak_N = 0;
  double rmse_N = 0;         ///< of the vectors, absolute
  double scale = 1;          ///< best factor: sensor = scale * estimate
  double rmse_scaled_N = 0;  ///< after that one factor
  double nrmse_pct = 0;      ///< of the sensor's peak
  double nrmse_scaled_pct = 0;
  double correlation = 0;  ///< of the magnitudes
};

/// Throws BadInput where they overlap by less than half of the video, where no force is to be seen in one of them, or
/// where the magnitudes correlate by less than 0.5 at any delay, or with a factor of nearly 0.
SensorComparison compare_with_sensor(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor);

/// The same with a log as it lies there; the sentences name it.
SensorComparison compare_with_log(const std::vector<ForceRow>& estimate, const std::filesystem::path& log);

/// The log in the video's time and the left camera frame, less its zero.
std::vector<SensorReading> aligned(const std::vector<SensorReading>& sensor, const SensorComparison& found);

/// Lines of name and value.
std::string to_text(const SensorComparison& found);

/// One JSON object.
std::string to_json(const SensorComparison& found);

}  // namespace palpate
