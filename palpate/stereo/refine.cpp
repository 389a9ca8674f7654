#include "palpate/stereo/refine.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace palpate {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
constexpr float kMostStep_px = 1.0f;
constexpr float kSteepest = 0.9f;
constexpr float kLeastCorrelation = 0.6f;
constexpr float kDeviationFloor_px = 0.02f;
// Neighbouring residuals are alike (video compression, reflections), which smoothing over cells about makes up for.
constexpr float kNoiseSpread = 1.1f;
constexpr float kSameSurface_px = 0.7f;
constexpr float kLeastAgreement = 0.3f;   // of the neighbours, by weight
constexpr float kLeastNeighbours = 4.0f;  // by weight

using RefineWindow = Window<16>;

float deviation_of(float information, float spread = kNoiseSpread) {
  return std::hypot(kDeviationFloor_px, spread / std::sqrt(information));
}

}  // namespace

void refine_cells(const Eyes& eyes, CellGrid& grid) {
  // A touch of blur takes the finest detail away, which interpolation between pixels gets wrong.
  cv::Mat left_grey, right_grey;
  cv::GaussianBlur(eyes.left, left_grey, {3, 3}, 0.6);
  cv::GaussianBlur(eyes.right, right_grey, {3, 3}, 0.6);
  const Level left = make_level(left_grey, eyes.left_mask);
  const Level right = make_level(right_grey, eyes.right_mask);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    RefineWindow window;
    for (int column = 0; column < grid.columns; ++column) {
      Cell& cell = grid.at(column, row);
      if (!cell.matched) continue;
      WindowFit found;
      cell.matched = window.cut(left, {column * CellGrid::kStep_px, row * CellGrid::kStep_px}) &&
                     window.fit(right, cell.plane, kMostStep_px, kSteepest, 2, found) &&
                     found.correlation > kLeastCorrelation;
      if (cell.matched) cell = {found.plane, found.correlation, found.information, true};
    }
  });
}

namespace {

constexpr int kSmoothRadius = 5;  // cells
using Vector6 = Eigen::Matrix<float, 6, 1>;

// One cell of the neighbourhood that a quadratic is fitted to, with its share in the normal equations; arrays of eight
// so that sums over them are vector instructions.
struct Neighbour {
  int column, row;
  float u, v;  // px
  float falloff;
  float basis[8];      // 1, u, v, u^2 / 2, u v, v^2 / 2
  float products[24];  // lower triangle of basis basis^T
};

std::vector<Neighbour> neighbourhood() {
  std::vector<Neighbour> all;
  for (int j = -kSmoothRadius; j <= kSmoothRadius; ++j)
    for (int i = -kSmoothRadius; i <= kSmoothRadius; ++i) {
      const float distance =
          static_cast<float>(i * i + j * j) / static_cast<float>((kSmoothRadius + 1) * (kSmoothRadius + 1));
      if (distance >= 1) continue;
      const float u = static_cast<float>(i * CellGrid::kStep_px), v = static_cast<float>(j * CellGrid::kStep_px);
      Neighbour n{i, j, u, v, (1 - distance) * (1 - distance), {1, u, v, 0.5f * u * u, u * v, 0.5f * v * v}, {}};
      for (int k = 0, at = 0; k < 6; ++k)
        for (int m = 0; m <= k; ++m) n.products[at++] = n.basis[k] * n.basis[m];
      all.push_back(n);
    }
  return all;
}

// Quadratic through the neighbours on the same surface, as a change of the cell's own plane; nothing where too few
// of the neighbours stand on it.
std::optional<Vector6> fit_quadratic(const CellGrid& grid, const std::vector<Cell>& cells,
                                     const std::vector<Neighbour>& around, int column, int row) {
  const DisparityPlane plane = cells[static_cast<size_t>(row * grid.columns + column)].plane;
  float products[24] = {}, sums[8] = {};
  float agreeing = 0, all = 0;
  for (const Neighbour& n : around) {
    if (!grid.holds(column + n.column, row + n.row)) continue;
    const Cell& other = cells[static_cast<size_t>((row + n.row) * grid.columns + column + n.column)];
    const float off = other.plane.d - plane.at(n.u, n.v);
    if (!other.matched) continue;
    all += n.falloff;
    if (std::abs(off) > kSameSurface_px + 1 / std::sqrt(other.information)) continue;
    agreeing += n.falloff;
    const float weight = other.information * n.falloff, weighted_off = weight * off;
    for (int k = 0; k < 24; ++k) products[k] += weight * n.products[k];
    for (int k = 0; k < 8; ++k) sums[k] += weighted_off * n.basis[k];
  }
  if (agreeing < kLeastAgreement * all || agreeing < kLeastNeighbours) return std::nullopt;
  Eigen::Matrix<float, 6, 6> A = Eigen::Matrix<float, 6, 6>::Zero();
  for (int k = 0, at = 0; k < 6; ++k)
    for (int m = 0; m <= k; ++m) A(k, m) = products[at++];
  // A weak belief in what the cell itself says where its neighbours are few: slopes to 0.1, curvatures to 0.005 / px.
  A.diagonal() += (Vector6() << 0, 100, 100, 40000, 40000, 40000).finished();
  return A.selfadjointView<Eigen::Lower>().llt().solve(Eigen::Map<const Vector6>(sums));
}

}  // namespace

void smooth_cells(CellGrid& grid) {
  // A window reports the disparity of a curved surface wrong by half its second moment times the curvature.
  constexpr float moment = (RefineWindow::kRadius + 1) * (RefineWindow::kRadius + 1) / 5.0f;
  const std::vector<Cell> before = grid.cells;
  const std::vector<Neighbour> around = neighbourhood();
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      Cell& cell = grid.at(column, row);
      if (!cell.matched) continue;
      const std::optional<Vector6> change = fit_quadratic(grid, before, around, column, row);
      cell.matched = change.has_value();
      if (!change) continue;
      cell.plane.d += (*change)[0] - 0.5f * moment * ((*change)[3] + (*change)[5]);
      cell.plane.dx += (*change)[1];
      cell.plane.dy += (*change)[2];
    }
  });
}

namespace {

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
          map.deviation_px.at<float>(y, x) = deviation_of(guess.information);
          map.correlation.at<float>(y, x) = guess.correlation;
        }
    }
  });
  return map;
}

namespace {

constexpr int kMeasureRadius = 5;
constexpr float kOtherNoiseSpread = 2.5f;  // of OpenCV's matchers against the rendered organs

cv::Mat warped_right(const Eyes& eyes, const cv::Mat& disparity, cv::Mat& weight) {
  cv::Mat map_x(disparity.size(), CV_32F), map_y(disparity.size(), CV_32F), right;
  for (int y = 0; y < disparity.rows; ++y)
    for (int x = 0; x < disparity.cols; ++x) {
      map_x.at<float>(y, x) = static_cast<float>(x) - disparity.at<float>(y, x);
      map_y.at<float>(y, x) = static_cast<float>(y);
    }
  cv::patchNaNs(map_x, -10);
  cv::remap(eyes.right, right, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::remap(eyes.right_mask, weight, map_x, map_y, cv::INTER_NEAREST, cv::BORDER_CONSTANT, cv::Scalar(0));
  weight &= eyes.left_mask;
  weight &= disparity == disparity;
  return right;
}

cv::Mat mean(const cv::Mat& values, const cv::Mat& weight_mean) {
  cv::Mat sum;
  const int size = 2 * kMeasureRadius + 1;
  cv::boxFilter(values, sum, CV_32F, {size, size});
  cv::divide(sum, weight_mean, sum);
  return sum;
}

}  // namespace

DisparityMap measure(const Eyes& eyes, const cv::Mat& disparity_px) {
  DisparityMap map;
  cv::Mat usable;
  const cv::Mat right = warped_right(eyes, disparity_px, usable);
  cv::Mat w, w_mean, slope;
  usable.convertTo(w, CV_32F, 1.0 / 255);
  cv::boxFilter(w, w_mean, CV_32F, {2 * kMeasureRadius + 1, 2 * kMeasureRadius + 1});
  w_mean += 1e-6f;
  cv::Sobel(eyes.left, slope, CV_32F, 1, 0, cv::FILTER_SCHARR, 1.0 / 32);
  const cv::Mat l = eyes.left.mul(w), r = right.mul(w), g = slope.mul(w);
  const cv::Mat ml = mean(l, w_mean), mr = mean(r, w_mean), mg = mean(g, w_mean);
  const cv::Mat ll = mean(l.mul(l), w_mean) - ml.mul(ml), rr = mean(r.mul(r), w_mean) - mr.mul(mr);
  const cv::Mat lr = mean(l.mul(r), w_mean) - ml.mul(mr), gg = mean(g.mul(g), w_mean) - mg.mul(mg);
  for (cv::Mat* m : {&map.disparity_px, &map.deviation_px, &map.correlation})
    *m = cv::Mat(disparity_px.size(), CV_32F, cv::Scalar(kNothing));
  const float pixels = (2 * kMeasureRadius + 1) * (2 * kMeasureRadius + 1);
  for (int y = 0; y < w.rows; ++y)
    for (int x = 0; x < w.cols; ++x) {
      const float a = ll.at<float>(y, x), b = rr.at<float>(y, x), c = gg.at<float>(y, x);
      if (!usable.at<uchar>(y, x) || a < 1e-2f || b < 1e-2f || c < 1e-3f) continue;
      const float correlation = lr.at<float>(y, x) / std::sqrt(a * b);
      const float residual = std::max(1e-3f, 2 * a * (1 - correlation));
      map.disparity_px.at<float>(y, x) = disparity_px.at<float>(y, x);
      map.correlation.at<float>(y, x) = correlation;
      map.deviation_px.at<float>(y, x) =
          deviation_of(c * pixels * w_mean.at<float>(y, x) / residual, kOtherNoiseSpread);
    }
  return map;
}

}  // namespace palpate
