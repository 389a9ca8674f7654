#include "palpate/stereo/fuse.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"

namespace palpate {
namespace {

constexpr float kGateDeviations = 3;  // between a frame and the median
constexpr float kGateFloor_px = 0.1f;
constexpr float kMaxWander = 3;         // deviations over time against the stated one
constexpr float kToDeviation = 1.4826;  // from a median distance
constexpr float kMedianOfMany = 1.57f;  // variance of a median against that of a mean

/// Of an even number the mean of both in the middle.
float middle_of(std::vector<float>& values) {
  const float upper = median_in_place(values);
  if (values.size() % 2) return upper;
  return 0.5f *
         (upper + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2)));
}

struct Sample {
  float disparity, deviation, correlation;
};

// The samples of one pixel over time; cleared where the pixel moves.
void keep_agreeing(std::vector<Sample>& samples, size_t min, std::vector<float>& buffer) {
  const auto give_up_below = [&] {
    if (samples.size() < min) samples.clear();
    return samples.empty();
  };
  if (give_up_below()) return;
  buffer.clear();
  for (const Sample& sample : samples) buffer.push_back(sample.disparity);
  const float middle = middle_of(buffer);
  std::erase_if(samples, [middle](const Sample& sample) {
    return std::abs(sample.disparity - middle) > kGateFloor_px + kGateDeviations * sample.deviation;
  });
  give_up_below();
}

// Part of the deviation that every frame has alike is `common`.
Sample fused(const std::vector<Sample>& samples, float common, std::vector<float>& buffer) {
  const auto middle = [&](auto value) {
    buffer.clear();
    for (const Sample& sample : samples) buffer.push_back(value(sample));
    return middle_of(buffer);
  };
  Sample result{};
  result.disparity = middle([](const Sample& sample) { return sample.disparity; });
  result.correlation = middle([](const Sample& sample) { return sample.correlation; });
  const float stated = middle([](const Sample& sample) { return sample.deviation; });
  const float wander =
      kToDeviation * middle([&](const Sample& sample) { return std::abs(sample.disparity - result.disparity); });
  const float own = std::sqrt(std::max(0.0f, stated * stated - common * common));
  if (wander > kGateFloor_px + kMaxWander * own) return {std::numeric_limits<float>::quiet_NaN(), 0, 0};
  const float n = static_cast<float>(samples.size()), over_time = std::min(own, wander);
  const float left = samples.size() < 3 ? 1 : std::min(1.0f, kMedianOfMany / n);
  result.deviation = std::sqrt(stated * stated - over_time * over_time * (1 - left));
  return result;
}

}  // namespace

DisparityMap fuse(const std::vector<DisparityMap>& frames) {
  if (frames.empty()) throw BadInput("no frame to fuse, expected at least one disparity map");
  const cv::Size size = frames[0].disparity_px.size();
  std::vector<float> rows, common;
  DisparityMap result;
  for (const DisparityMap& frame : frames) {
    if (frame.disparity_px.size() != size)
      throw BadInput(fmt::format("a disparity map of {}x{} px cannot be fused with one of {}x{} px",
                                 frame.disparity_px.cols, frame.disparity_px.rows, size.width, size.height));
    rows.push_back(static_cast<float>(frame.row_offset_px));
    common.push_back(static_cast<float>(frame.calibration_deviation_px));
    if (result.warnings.empty()) result.warnings = frame.warnings;
  }
  result.row_offset_px = middle_of(rows);
  result.calibration_deviation_px = middle_of(common);
  for (cv::Mat* m : {&result.disparity_px, &result.deviation_px, &result.correlation})
    *m = cv::Mat(size, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  const size_t min = (frames.size() + 1) / 2;
  tbb::parallel_for(0, size.height, [&](int y) {
    std::vector<Sample> samples;
    std::vector<float> buffer;
    for (int x = 0; x < size.width; ++x) {
      samples.clear();
      for (const DisparityMap& frame : frames)
        if (const float d = frame.disparity_px.at<float>(y, x); !std::isnan(d))
          samples.push_back({d, frame.deviation_px.at<float>(y, x), frame.correlation.at<float>(y, x)});
      keep_agreeing(samples, min, buffer);
      if (samples.empty()) continue;
      const Sample one = fused(samples, static_cast<float>(result.calibration_deviation_px), buffer);
      if (std::isnan(one.disparity)) continue;
      result.disparity_px.at<float>(y, x) = one.disparity;
      result.deviation_px.at<float>(y, x) = one.deviation;
      result.correlation.at<float>(y, x) = one.correlation;
    }
  });
  return result;
}

}  // namespace palpate
