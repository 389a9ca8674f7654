#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace palpate {

/// Force over the last seconds, kept from frame to frame (Figs. 4 and 5 of the paper). The scale only grows, in round
/// steps, so that the curve does not jump.
class StripChart {
 public:
  /// Shows the last `duration_s` seconds of forces in `unit`, "N" or "N/kPa".
  explicit StripChart(double duration_s, std::string unit = "N");

  /// `force_N` is empty in a frame without an answer: the curve has a gap there.
  void add(double time_s, std::optional<double> force_N);

  /// End of the axis of force, N.
  double max_N() const { return max_N_; }

  /// Draws the chart with axes, ticks and units on a dark veil in `area` of a BGR image; `colour` (BGR) is the curve's.
  void draw(cv::Mat& image, const cv::Rect& area, const cv::Scalar& colour, double scale) const;

 private:
  struct Sample {
    double time_s = 0;
    std::optional<double> force_N;
  };

  double duration_s_;
  std::string unit_;
  double max_N_;
  std::deque<Sample> samples_;
};

}  // namespace palpate
