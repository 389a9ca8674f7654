#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/stereo/refine.h"

namespace palpate {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
// Neighbouring residuals are alike (video compression, reflections), which smoothing over cells about makes up for.
constexpr float kNoiseSpread = 1.1f;

// Difference of two small windows without their means, grey levels; large where the right one leaves the image.
float window_difference(const Eyes& eyes, cv::Point at, float disparity) {
  constexpr int r = 2;
  const float x = static_cast<float>(at.x) - disparity;
  const int whole = cvFloor(x);
  if (whole < r || whole + r + 1 >= eyes.right.cols || at.x < r || at.x + r >= eyes.left.cols || at.y < r ||
      at.y + r >= eyes.left.rows)
    return std::numeric_limits<float>::max();
  const float t = x - static_cast<float>(whole);
  float sum = 0, squares = 0;
  for (int v = -r; v <= r; ++v) {
    const float* a = eyes.left.ptr<float>(at.y + v) + at.x;
    const float* b = eyes.right.ptr<float>(at.y + v) + whole;
    for (int u = -r; u <= r; ++u) {
      const float difference = a[u] - b[u] - t * (b[u + 1] - b[u]);
      sum += difference;
      squares += difference * difference;
    }
  }
  constexpr float n = (2 * r + 1) * (2 * r + 1);
  return squares - 0.5f * sum * sum / n;
}

// What the cells around one pixel say about it.
struct PixelGuess {
  float disparity = kNothing;
  float information = 0;
  float correlation = 0;
};

// Bilinear mean of the four cells around, as far as they stand on the same surface as the first of them.
PixelGuess blend(const CellGrid& grid, cv::Point at) {
  constexpr int step = CellGrid::kStep_px;
  const int column = at.x / step, row = at.y / step;
  float weights = 0, first = 0;
  PixelGuess sum{0, 0, 0};
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      if (!grid.holds(column + i, row + j) || !grid.at(column + i, row + j).matched) continue;
      const Cell& cell = grid.at(column + i, row + j);
      const float u = static_cast<float>(at.x - (column + i) * step), v = static_cast<float>(at.y - (row + j) * step);
      const float weight = (step - std::abs(u)) * (step - std::abs(v));
      const float value = cell.plane.at(u, v);
      if (weights == 0) first = value;
      if (std::abs(value - first) > 1) continue;
      sum.disparity += weight * value;
      sum.information += weight * cell.information;
      sum.correlation += weight * cell.correlation;
      weights += weight;
    }
  if (weights == 0) return {};
  return {sum.disparity / weights, sum.information / weights, sum.correlation / weights};
}

// Large windows carry the disparity of one surface a few pixels over the edge of the next. Near a step of depth, the
// surfaces around compete for the pixel in a small window.
PixelGuess compete(const Eyes& eyes, const CellGrid& grid, cv::Point at, const PixelGuess& before) {
  constexpr int step = CellGrid::kStep_px;
  constexpr float kClearlyBetter = 0.7f;
  PixelGuess best = before;
  float least = -1;
  for (int row = at.y / step - 1; row <= at.y / step + 2; ++row)
    for (int column = at.x / step - 1; column <= at.x / step + 2; ++column) {
      if (!grid.holds(column, row) || !grid.at(column, row).matched) continue;
      const Cell& cell = grid.at(column, row);
      const float value =
          cell.plane.at(static_cast<float>(at.x - column * step), static_cast<float>(at.y - row * step));
      if (std::abs(value - best.disparity) < 1) continue;
      if (least < 0) least = kClearlyBetter * window_difference(eyes, at, before.disparity);
      const float difference = window_difference(eyes, at, value);
      if (difference >= least) continue;
      least = difference;
      best = {value, cell.information, cell.correlation};
    }
  return best;
}

// Whether cells around the square between four cells disagree about it.
bool contested(const CellGrid& grid, int column, int row) {
  float least = std::numeric_limits<float>::max(), most = -least;
  for (int j = -1; j <= 2; ++j)
    for (int i = -1; i <= 2; ++i) {
      if (!grid.holds(column + i, row + j) || !grid.at(column + i, row + j).matched) continue;
      const float value = grid.at(column + i, row + j)
                              .plane.at(CellGrid::kStep_px * (0.5f - static_cast<float>(i)),
                                        CellGrid::kStep_px * (0.5f - static_cast<float>(j)));
      least = std::min(least, value);
      most = std::max(most, value);
    }
  return most - least > 1;
}

}  // namespace

DisparityMap fill_between_cells(const Eyes& eyes, const CellGrid& grid) {
  const cv::Size size = eyes.left.size();
  constexpr int step = CellGrid::kStep_px;
  DisparityMap map;
  for (cv::Mat* m : {&map.disparity_px, &map.deviation_px, &map.correlation})
    *m = cv::Mat(size, CV_32F, cv::Scalar(kNothing));
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const bool competition = contested(grid, column, row);
      for (int y = row * step; y < std::min(size.height, (row + 1) * step); ++y)
        for (int x = column * step; x < std::min(size.width, (column + 1) * step); ++x) {
          if (!eyes.left_mask.at<uchar>(y, x)) continue;
          PixelGuess guess = blend(grid, {x, y});
          if (std::isnan(guess.disparity)) continue;
          if (competition) guess = compete(eyes, grid, {x, y}, guess);
          map.disparity_px.at<float>(y, x) = guess.disparity;
          map.deviation_px.at<float>(y, x) = deviation_px(guess.information, kNoiseSpread);
          map.correlation.at<float>(y, x) = guess.correlation;
        }
    }
  });
  return map;
}

}  // namespace palpate
