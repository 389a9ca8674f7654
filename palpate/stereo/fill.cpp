#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/stereo/refine.h"

namespace palpate {
namespace {

constexpr float kNoise = 25 * 2 * 3 * 3;  // of a comparison with three grey levels of noise in each camera
constexpr float kMaxDifference = 0.6f;    // of two windows, of what the left one shows
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

// Two small windows compared.
struct Comparison {
  bool possible = false;  // both windows lie in their images
  float difference = 0;   // sum of squares without the means, grey levels
  float texture = 0;      // likewise of the left window alone
};

// 5 x 5, two rows at a time.
Comparison compare(const PreparedPair& prepared, cv::Point at, float disparity) {
  constexpr int r = 2, pixels = (2 * r + 1) * (2 * r + 1);
  constexpr FloatLanes kBoth = {1, 1, 1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1, 0, 0, 0};
  constexpr FloatLanes kFirst = {1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const float x = static_cast<float>(at.x) - disparity;
  const int whole = cvFloor(x);
  if (whole < r || whole + 7 >= prepared.right.cols || at.x < r || at.x + 6 >= prepared.left.cols || at.y < r ||
      at.y + r >= prepared.left.rows)
    return {};
  const float t = x - static_cast<float>(whole), middle = prepared.left.at<float>(at);
  FloatLanes sum = {}, squares = {}, left_sum = {}, left_squares = {};
  for (int v = -r; v <= r; v += 2) {
    const int next = std::min(v + 1, r);
    const FloatLanes& weight = v < r ? kBoth : kFirst;
    const float *a = prepared.left.ptr<float>(at.y + v) + at.x - r,
                *b = prepared.left.ptr<float>(at.y + next) + at.x - r;
    const float *c = prepared.right.ptr<float>(at.y + v) + whole - r,
                *d = prepared.right.ptr<float>(at.y + next) + whole - r;
    const FloatLanes left = (load_halves(a, b) - middle) * weight;
    const FloatLanes right = (1 - t) * load_halves(c, d) + t * load_halves(c + 1, d + 1) - middle;
    const FloatLanes difference = left - right * weight;
    sum += difference, squares += difference * difference;
    left_sum += left, left_squares += left * left;
  }
  const float mean = total(sum), left_mean = total(left_sum);
  return {true, total(squares) - mean * mean / pixels, total(left_squares) - left_mean * left_mean / pixels};
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

// The cells around the square between four of them.
struct Surroundings {
  struct Surface {
    const Cell* cell;
    float u, v;    // of the square's first pixel from the cell, px
    float middle;  // disparity in the middle of the square
  };
  Surface surfaces[kLanes];  // that differ in the middle of the square
  int count = 0;
  bool contested = false;  // they disagree by more than a pixel
  bool ragged = false;     // some cells are missing
};

Surroundings surroundings(const CellGrid& grid, int column, int row) {
  constexpr float kDiffer_px = 0.5f;
  float min = std::numeric_limits<float>::max(), max = -min;
  Surroundings result;
  for (int j = -1; j <= 2; ++j)
    for (int i = -1; i <= 2; ++i) {
      if (!grid.holds(column + i, row + j)) continue;
      const Cell& cell = grid.at(column + i, row + j);
      if (!cell.matched) {
        result.ragged = true;
        continue;
      }
      const float u = static_cast<float>(-kStep * i), v = static_cast<float>(-kStep * j);
      const float middle = cell.plane.at(u + 0.5f * kStep, v + 0.5f * kStep);
      min = std::min(min, middle);
      max = std::max(max, middle);
      const auto like = [middle](const Surroundings::Surface& s) { return std::abs(s.middle - middle) < kDiffer_px; };
      if (std::none_of(result.surfaces, result.surfaces + result.count, like))
        result.surfaces[result.count++] = {&cell, u, v, middle};
    }
  result.contested = max - min > 1;
  return result;
}

// Large windows carry the disparity of one surface a few pixels over the edge of the next. Near a step of depth, the
// surfaces around compete for the pixel (i, j) of the square, that stands at `at`, in a small window.
PixelGuess compete(const PreparedPair& prepared, const Surroundings& around, cv::Point in_square, cv::Point at,
                   const PixelGuess& before) {
  constexpr float kClearlyBetter = 0.7f;
  PixelGuess best = before;
  float min = 0;
  bool compared = false;
  for (int k = 0; k < around.count; ++k) {
    const Surroundings::Surface& surface = around.surfaces[k];
    const Cell& cell = *surface.cell;
    const float value =
        cell.plane.at(surface.u + static_cast<float>(in_square.x), surface.v + static_cast<float>(in_square.y));
    if (std::abs(value - before.disparity) < 1) continue;
    if (!compared) {
      compared = true;
      const Comparison comparison = compare(prepared, at, before.disparity);
      if (!comparison.possible) return before;
      min = kClearlyBetter * comparison.difference - kNoise / 6;
    }
    const Comparison comparison = compare(prepared, at, value);
    if (!comparison.possible || comparison.difference >= min) continue;
    min = comparison.difference;
    best = {value, cell.information, cell.correlation};
  }
  return best;
}

// At an edge, what is hidden from the other camera would take the disparity of its neighbours: there the windows differ
// by more than the left one shows.
bool confirmed(const PreparedPair& prepared, cv::Point at, float disparity) {
  const Comparison comparison = compare(prepared, at, disparity);
  return !comparison.possible || comparison.difference < kMaxDifference * comparison.texture + kNoise;
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

DisparityMap fill_between_cells(const PreparedPair& prepared, const CellGrid& grid) {
  const cv::Size size = prepared.left.size();
  DisparityMap map;
  for (cv::Mat* m : {&map.disparity_px, &map.deviation_px, &map.correlation})
    *m = cv::Mat(size, CV_32F, cv::Scalar(kNothing));
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Square square = blend(grid, column, row);
      const Surroundings around = surroundings(grid, column, row);
      for (int i = 0; i < kLanes; ++i) {
        const int x = column * kStep + i % kStep, y = row * kStep + i / kStep;
        if (x >= size.width || y >= size.height || !prepared.wanted.at<uchar>(y, x)) continue;
        PixelGuess guess{square.disparity[i], square.information[i], square.correlation[i]};
        if (std::isnan(guess.disparity)) continue;
        if (around.contested) guess = compete(prepared, around, {i % kStep, i / kStep}, {x, y}, guess);
        if ((around.contested || around.ragged) && prepared.left_mask.at<uchar>(y, x) &&
            !confirmed(prepared, {x, y}, guess.disparity))
          continue;
        map.disparity_px.at<float>(y, x) = guess.disparity;
        map.deviation_px.at<float>(y, x) = deviation_px(guess.information);
        map.correlation.at<float>(y, x) = guess.correlation;
      }
    }
  });
  return map;
}

}  // namespace palpate
