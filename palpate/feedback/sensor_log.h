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

/// Columns time_s, fx_N, fy_N, fz_N, or Time, Fx, Fy, Fz as ATI's programs write them; others are ignored. Throws
/// BadInput where a column is missing, fewer than ten rows have numbers, or the time does not grow.
std::vector<SensorReading> read_sensor_log(const std::filesystem::path& file);

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

/// Throws BadInput where they overlap by less than half of the video, or where no force is to be seen in one of them.
SensorComparison compare_with_sensor(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor);

/// The log in the video's time and the left camera frame, less its zero.
std::vector<SensorReading> aligned(const std::vector<SensorReading>& sensor, const SensorComparison& found);

/// Lines of name and value.
std::string to_text(const SensorComparison& found);

/// One JSON object.
std::string to_json(const SensorComparison& found);

}  // namespace palpate
