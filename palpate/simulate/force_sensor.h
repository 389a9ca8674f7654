#pragma once

#include <filesystem>
#include <vector>

#include "palpate/simulate/dejavu_files.h"

namespace palpate {

/// What a force sensor makes of a force; palpate compare --sensor has to find out all of it but rate and noise.
struct ForceSensor {
  double rate_Hz = 100;
  double clock_ahead_s = 0;  ///< time of the log minus time of the video
  double jitter_s = 0.001;   ///< standard deviation of a reading's time
  Mat3 camera_from_sensor = Mat3::Identity();
  Vec3 zero_N = Vec3::Zero();  ///< what it reads without force, in its axes
  double noise_N = 0.02;       ///< standard deviation of each reading; an ATI Mini40 resolves 0.01 to 0.02 N
};

/// A sensor with the axes of a tool whose shaft points along `tool_axis` (its z; x and y turned about it by chance), a
/// clock that was started by chance, and a zero of up to 2 N.
ForceSensor make_force_sensor(const Vec3& tool_axis, int seed);

/// One reading; force of the instrument on the tissue, in the sensor's axes.
struct LoggedForce {
  double time_s = 0;
  Vec3 force_N = Vec3::Zero();
};

/// The log from one second before the video to one second after it. Between two frames the force goes in a straight
/// line. `rows`: at least one, time growing.
std::vector<LoggedForce> log_of(const ForceSensor& sensor, const std::vector<TruthRow>& rows, int seed);

/// sensor.csv (Status, Time, Fx, Fy, Fz as ATI's programs name them) and sensor.yaml in `folder`. Throws Unfinished.
void write_force_sensor(const std::filesystem::path& folder, const ForceSensor& sensor,
                        const std::vector<LoggedForce>& log);

}  // namespace palpate
