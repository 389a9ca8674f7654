#include "palpate/stereo/refine.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
constexpr float kMostStep_px = 0.5f;  // of one iteration
constexpr float kLeastCorrelation = 0.5f;
constexpr float kLeastShare = 0.35f;  // of the window that must be usable
constexpr float kDeviationFloor_px = 0.02f;
constexpr float kNoiseSpread = 2.0f;  // neighbouring residuals are alike (video compression, model error)

// What a window needs, one sum each.
enum Sum { w, l, r, g, ll, rr, lr, gg, gl, gr, kSums };

// Cubic (Catmull-Rom) interpolation and its derivative; x at least one pixel inside.
struct Sample {
  float value, slope;
};
Sample sample(const float* row, float x) {
  const int i = static_cast<int>(x);
  const float t = x - static_cast<float>(i);
  const float a = row[i - 1], b = row[i], c = row[i + 1], d = row[i + 2];
  const float c1 = 0.5f * (c - a), c2 = a - 2.5f * b + 2 * c - 0.5f * d, c3 = 0.5f * (d - a) + 1.5f * (b - c);
  return {b + t * (c1 + t * (c2 + t * c3)), c1 + t * (2 * c2 + 3 * t * c3)};
}

// The products of one row of pixels, zero where a pixel has no weight.
void products_of_row(const Eyes& eyes, const cv::Mat& disparity, int y, std::array<std::vector<float>, kSums>& out) {
  const int width = disparity.cols;
  const float* left = eyes.left.ptr<float>(y);
  const float* right = eyes.right.ptr<float>(y);
  const uchar* left_mask = eyes.left_mask.ptr(y);
  const uchar* right_mask = eyes.right_mask.ptr(y);
  const float* d = disparity.ptr<float>(y);
  for (auto& channel : out) std::fill(channel.begin(), channel.end(), 0.0f);
  for (int x = 1; x + 1 < width; ++x) {
    const float there = static_cast<float>(x) - d[x];
    if (!(there >= 1 && there < static_cast<float>(width - 3)) || !left_mask[x]) continue;
    if (!right_mask[static_cast<int>(there + 0.5f)]) continue;
    const Sample s = sample(right, there);
    const float a = left[x] - 100, b = s.value - 100;  // smaller numbers keep the sums exact
    const float slope = 0.5f * (s.slope + 0.5f * (left[x + 1] - left[x - 1]));
    const size_t i = static_cast<size_t>(x);
    out[w][i] = 1;
    out[l][i] = a;
    out[r][i] = b;
    out[g][i] = slope;
    out[ll][i] = a * a;
    out[rr][i] = b * b;
    out[lr][i] = a * b;
    out[gg][i] = slope * slope;
    out[gl][i] = slope * a;
    out[gr][i] = slope * b;
  }
}

struct Answer {
  float step = 0, correlation = -1, deviation = kNothing;
  bool valid = false;
};

Answer solve(const std::array<float, kSums>& s, float full_weight) {
  Answer answer;
  const float n = s[w];
  if (n < kLeastShare * full_weight) return answer;
  const float c_ll = s[ll] - s[l] * s[l] / n, c_rr = s[rr] - s[r] * s[r] / n, c_lr = s[lr] - s[l] * s[r] / n;
  const float c_gg = s[gg] - s[g] * s[g] / n, c_gl = s[gl] - s[g] * s[l] / n, c_gr = s[gr] - s[g] * s[r] / n;
  if (c_ll < 1e-2f * n || c_rr < 1e-2f * n || c_gg < 1e-3f * n) return answer;
  const float gain = std::sqrt(c_ll / c_rr);
  answer.correlation = c_lr / std::sqrt(c_ll * c_rr);
  const float descent = c_gl - gain * c_gr;
  answer.step = std::clamp(-descent / c_gg, -kMostStep_px, kMostStep_px);
  const float residual = std::max(0.0f, c_ll + gain * gain * c_rr - 2 * gain * c_lr - descent * descent / c_gg) / n;
  answer.deviation = std::hypot(kDeviationFloor_px, kNoiseSpread * std::sqrt(residual / c_gg));
  answer.valid = answer.correlation > kLeastCorrelation;
  return answer;
}

// Box sums over a band of rows: columns are added and taken off as the band moves down, then summed along the row.
void refine_rows(const Eyes& eyes, const cv::Mat& disparity, int radius, int first, int last, bool move,
                 DisparityMap& out) {
  const int width = disparity.cols, height = disparity.rows;
  const int size = 2 * radius + 1;
  std::vector<std::array<std::vector<float>, kSums>> ring(static_cast<size_t>(size));
  for (auto& row : ring)
    for (auto& channel : row) channel.assign(static_cast<size_t>(width), 0.0f);
  std::array<std::vector<double>, kSums> columns;
  for (auto& channel : columns) channel.assign(static_cast<size_t>(width), 0.0);

  const auto add = [&](int y, double sign) {
    auto& row = ring[static_cast<size_t>((y + size) % size)];
    if (sign > 0) products_of_row(eyes, disparity, y, row);
    for (int k = 0; k < kSums; ++k) {
      double* column = columns[static_cast<size_t>(k)].data();
      const float* products = row[static_cast<size_t>(k)].data();
      for (int x = 0; x < width; ++x) column[x] += sign * products[x];
    }
  };
  for (int y = std::max(0, first - radius); y < std::min(height, first + radius); ++y) add(y, 1);
  for (int y = first; y < last; ++y) {
    if (y + radius < height) add(y + radius, 1);
    std::array<double, kSums> sums{};
    for (int x = 0; x < std::min(radius, width); ++x)
      for (int k = 0; k < kSums; ++k)
        sums[static_cast<size_t>(k)] += columns[static_cast<size_t>(k)][static_cast<size_t>(x)];
    const float* d = disparity.ptr<float>(y);
    for (int x = 0; x < width; ++x) {
      for (int k = 0; k < kSums; ++k) {
        const auto& column = columns[static_cast<size_t>(k)];
        if (x + radius < width) sums[static_cast<size_t>(k)] += column[static_cast<size_t>(x + radius)];
        if (x - radius > 0) sums[static_cast<size_t>(k)] -= column[static_cast<size_t>(x - radius - 1)];
      }
      out.disparity_px.at<float>(y, x) = kNothing;
      out.deviation_px.at<float>(y, x) = kNothing;
      out.correlation.at<float>(y, x) = kNothing;
      if (std::isnan(d[x])) continue;
      std::array<float, kSums> single;
      for (size_t k = 0; k < kSums; ++k) single[k] = static_cast<float>(sums[k]);
      const Answer answer = solve(single, static_cast<float>(size * size));
      if (!answer.valid) continue;
      out.disparity_px.at<float>(y, x) = move ? d[x] + answer.step : d[x];
      out.deviation_px.at<float>(y, x) = answer.deviation;
      out.correlation.at<float>(y, x) = answer.correlation;
    }
    if (y - radius >= 0) add(y - radius, -1);
  }
}

DisparityMap pass(const Eyes& eyes, const cv::Mat& disparity, int radius, bool move) {
  DisparityMap out;
  for (cv::Mat* map : {&out.disparity_px, &out.deviation_px, &out.correlation}) map->create(disparity.size(), CV_32F);
  constexpr int kBand = 64;  // rows; fixed, so that sums do not depend on the thread count
  const int bands = (disparity.rows + kBand - 1) / kBand;
  tbb::parallel_for(0, bands, [&](int band) {
    refine_rows(eyes, disparity, radius, band * kBand, std::min(disparity.rows, (band + 1) * kBand), move, out);
  });
  return out;
}

}  // namespace

cv::Mat fill_between_cells(const CellGrid& grid, const cv::Mat& left_mask) {
  constexpr int step = CellGrid::kStep_px;
  cv::Mat disparity(left_mask.size(), CV_32F, cv::Scalar(kNothing));
  tbb::parallel_for(0, left_mask.rows, [&](int y) {
    float* out = disparity.ptr<float>(y);
    const uchar* mask = left_mask.ptr(y);
    for (int x = 0; x < left_mask.cols; ++x) {
      if (!mask[x]) continue;
      const int column = x / step, row = y / step;
      float sum = 0, weights = 0, nearest = 0;
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
          const int c = column + i, r = row + j;
          if (c >= grid.columns || r >= grid.rows || !grid.at(c, r).matched) continue;
          const DisparityPlane& plane = grid.at(c, r).plane;
          const float u = static_cast<float>(x - c * step), v = static_cast<float>(y - r * step);
          const float weight = (step - std::abs(u)) * (step - std::abs(v));
          const float value = plane.d + plane.dx * u + plane.dy * v;
          if (weights == 0) nearest = value;
          if (std::abs(value - nearest) > 1) continue;  // across a step of depth, no mixing
          sum += weight * value;
          weights += weight;
        }
      if (weights > 0) out[x] = sum / weights;
    }
  });
  return disparity;
}

DisparityMap refine(const Eyes& eyes, const cv::Mat& start_px, int radius_px, int iterations) {
  DisparityMap map;
  map.disparity_px = start_px;
  for (int i = 0; i < iterations; ++i) map = pass(eyes, map.disparity_px, radius_px, true);
  return map;
}

DisparityMap measure(const Eyes& eyes, const cv::Mat& disparity_px) {
  return pass(eyes, disparity_px, 5, false);
}

}  // namespace palpate
