#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/stereo/refine.h"

namespace palpate {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

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

// What the four cells at the corners of a square say about its 4 x 4 pixels, row by row; NaN where they say nothing.
struct Square {
  FloatLanes disparity = {}, information = {}, correlation = {};
};

constexpr int kStep = CellGrid::kStep_px;
static_assert(kStep * kStep == kLanes);
constexpr FloatLanes kX = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
constexpr FloatLanes kY = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

// Bilinear means of the four cells, as far as they stand on the same surface as the first of them.
Square blend(const CellGrid& grid, int column, int row) {
  Square sum;
  FloatLanes weights = {}, first = {};
  bool found = false;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      if (!grid.holds(column + i, row + j) || !grid.at(column + i, row + j).matched) continue;
      const Cell& cell = grid.at(column + i, row + j);
      const FloatLanes u = kX - static_cast<float>(i * kStep), v = kY - static_cast<float>(j * kStep);
      const FloatLanes value = cell.plane.d + cell.plane.dx * u + cell.plane.dy * v;
      if (!found) first = value;
      found = true;
      const FloatLanes apart = value - first, nothing = {};
      const FloatLanes near = (i ? kX : kStep - kX) * (j ? kY : kStep - kY);
      const FloatLanes weight = apart <= 1 ? (apart >= -1 ? near : nothing) : nothing;
      sum.disparity += weight * value;
      sum.information += weight * cell.information;
      sum.correlation += weight * cell.correlation;
      weights += weight;
    }
  return {sum.disparity / weights, sum.information / weights, sum.correlation / weights};
}

// What the cells say about one pixel.
struct PixelGuess {
  float disparity = kNothing;
  float information = 0;
  float correlation = 0;
};

// Large windows carry the disparity of one surface a few pixels over the edge of the next. Near a step of depth, the
// surfaces around compete for the pixel in a small window.
PixelGuess compete(const Eyes& eyes, const CellGrid& grid, cv::Point at, const PixelGuess& before) {
  constexpr float kClearlyBetter = 0.7f;
  PixelGuess best = before;
  float least = -1;
  float tried[kLanes];
  int tries = 0;
  for (int row = at.y / kStep - 1; row <= at.y / kStep + 2; ++row)
    for (int column = at.x / kStep - 1; column <= at.x / kStep + 2; ++column) {
      if (!grid.holds(column, row) || !grid.at(column, row).matched) continue;
      const Cell& cell = grid.at(column, row);
      const float value =
          cell.plane.at(static_cast<float>(at.x - column * kStep), static_cast<float>(at.y - row * kStep));
      if (std::abs(value - before.disparity) < 1) continue;
      if (std::any_of(tried, tried + tries, [value](float t) { return std::abs(value - t) < 0.3f; })) continue;
      tried[tries++] = value;
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
                              .plane.at(kStep * (0.5f - static_cast<float>(i)), kStep * (0.5f - static_cast<float>(j)));
      least = std::min(least, value);
      most = std::max(most, value);
    }
  return most - least > 1;
}

}  // namespace

cv::Mat disparity_between_cells(const CellGrid& grid, cv::Size size) {
  cv::Mat disparity(size, CV_32F);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Square square = blend(grid, column, row);
      const int width = std::min(kStep, size.width - column * kStep);
      for (int y = 0; y < std::min(kStep, size.height - row * kStep); ++y)
        for (int x = 0; x < width; ++x)
          disparity.at<float>(row * kStep + y, column * kStep + x) = square.disparity[y * kStep + x];
    }
  });
  return disparity;
}

DisparityMap fill_between_cells(const Eyes& eyes, const CellGrid& grid) {
  const cv::Size size = eyes.left.size();
  DisparityMap map;
  for (cv::Mat* m : {&map.disparity_px, &map.deviation_px, &map.correlation})
    *m = cv::Mat(size, CV_32F, cv::Scalar(kNothing));
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Square square = blend(grid, column, row);
      const bool competition = contested(grid, column, row);
      for (int i = 0; i < kLanes; ++i) {
        const int x = column * kStep + i % kStep, y = row * kStep + i / kStep;
        if (x >= size.width || y >= size.height || !eyes.wanted.at<uchar>(y, x)) continue;
        PixelGuess guess{square.disparity[i], square.information[i], square.correlation[i]};
        if (std::isnan(guess.disparity)) continue;
        if (competition) guess = compete(eyes, grid, {x, y}, guess);
        map.disparity_px.at<float>(y, x) = guess.disparity;
        map.deviation_px.at<float>(y, x) = deviation_px(guess.information);
        map.correlation.at<float>(y, x) = guess.correlation;
      }
    }
  });
  return map;
}

}  // namespace palpate
