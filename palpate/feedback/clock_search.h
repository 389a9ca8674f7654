#pragma once

#include <vector>

#include "palpate/feedback/sensor_log.h"

namespace palpate {

/// Delays (sensor time minus video time, s) at which a log follows an estimate best, whatever turns its axes and
/// whatever its zero is, the best one first; at each, at least `least_overlap` of the video lies within the log. By
/// cross-correlation of both on a common grid (FFT), normalised for what overlaps: the score of a delay is the norm of
/// the 3 x 3 cross-covariance, which no rotation changes. Empty where they overlap nowhere by that much.
std::vector<double> likely_delays_s(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor,
                                    double min_overlap, double step_s);

}  // namespace palpate
