#include "palpate/stereo/refine.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr float kMaxStep_px = 1.0f;
constexpr float kSteepest = 0.9f;
constexpr float kMinCorrelation = 0.6f;
constexpr float kMinFraction = 0.2f;   // of the window's weight
constexpr float kMinGradient = 0.02f;  // mean square of the gradient, grey levels per px
constexpr int kRadius = 7;
constexpr int kRows = 2 * kRadius + 1;
constexpr FloatLanes kColumn = {-7, -6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 7, 8};

constexpr float falloff(float t) {
  return 1 - t * t / ((kRadius + 1) * (kRadius + 1));
}

// The left image, the right one drawn where the left one sees it, their mean slope along the row, and where both are
// known. With margins as in Level.
struct Superposed {
  cv::Mat left, right, slope, weight;
};

Superposed superpose(const Level& left, const Level& right, const cv::Mat& disparity) {
  constexpr int m = Level::kMargin_px;
  Superposed result;
  result.left = left.grey;
  for (cv::Mat* plane : {&result.right, &result.slope, &result.weight})
    *plane = cv::Mat(left.grey.size(), CV_32F, cv::Scalar(0));
  const float max = static_cast<float>(left.size.width - 1);
  tbb::parallel_for(0, left.size.height, [&](int y) {
    const float* d = disparity.ptr<float>(y);
    const float *grey = right.grey_at(0, y), *mask = right.weight_at(0, y);
    const float *left_slope = left.gradient_at(0, y), *left_mask = left.weight_at(0, y);
    float* value = result.right.ptr<float>(y + m) + m;
    float* slope = result.slope.ptr<float>(y + m) + m;
    float* weight = result.weight.ptr<float>(y + m) + m;
    for (int x = 0; x < left.size.width; ++x) {
      const float at = static_cast<float>(x) - d[x];
      const bool inside = at >= 0 && at <= max;  // false for NaN
      const float there = inside ? at : 0;
      const int whole = static_cast<int>(there);
      const float t = there - static_cast<float>(whole);
      // Catmull-Rom and its derivative.
      const float a = grey[whole - 1], b = grey[whole], c = grey[whole + 1], e = grey[whole + 2];
      const float c1 = 0.5f * (c - a), c2 = a - 2.5f * b + 2 * c - 0.5f * e, c3 = 0.5f * (e - a) + 1.5f * (b - c);
      value[x] = b + t * (c1 + t * (c2 + t * c3));
      slope[x] = 0.5f * (left_slope[x] + c1 + t * (2 * c2 + 3 * t * c3));
      weight[x] = inside ? left_mask[x] * mask[static_cast<int>(there + 0.5f)] : 0;
    }
  });
  return result;
}

// Sums over the window around a pixel, 15 x 15.
WindowSums sums_around(const Superposed& images, int x, int y) {
  constexpr int m = Level::kMargin_px;
  const float middle = images.left.at<float>(y + m, x + m);
  const FloatLanes column_falloff = 1 - kColumn * kColumn / static_cast<float>((kRadius + 1) * (kRadius + 1));
  FloatLanes n = {}, l = {}, r = {}, ll = {}, rr = {}, lr = {}, g = {}, gv = {}, gg = {}, ggv = {}, ggvv = {};
  FloatLanes gl = {}, glv = {}, gr = {}, grv = {};
  for (int j = 0; j < kRows; ++j) {
    const int row = y + j - kRadius + m, first = x - kRadius + m;
    const float v = static_cast<float>(j - kRadius);
    const FloatLanes left = load_lanes(images.left.ptr<float>(row) + first) - middle;
    const FloatLanes right = load_lanes(images.right.ptr<float>(row) + first) - middle;
    const FloatLanes slope = load_lanes(images.slope.ptr<float>(row) + first);
    const FloatLanes w = load_lanes(images.weight.ptr<float>(row) + first) * (column_falloff * falloff(v));
    const FloatLanes wl = w * left, wr = w * right, wg = w * slope;
    const FloatLanes wgg = wg * slope, wgl = wg * left, wgr = wg * right;
    n += w, l += wl, r += wr, g += wg, gv += wg * v;
    ll += wl * left, rr += wr * right, lr += wl * right;
    gg += wgg, ggv += wgg * v, ggvv += wgg * (v * v);
    gl += wgl, glv += wgl * v, gr += wgr, grv += wgr * v;
  }
  WindowSums sums;
  sums.n = total(n), sums.l = total(l), sums.r = total(r);
  sums.ll = total(ll), sums.rr = total(rr), sums.lr = total(lr);
  sums.g = total(g), sums.gu = total(g * kColumn), sums.gv = total(gv);
  sums.gg = total(gg), sums.ggu = total(gg * kColumn), sums.ggv = total(ggv);
  sums.gguu = total(gg * kColumn * kColumn), sums.gguv = total(ggv * kColumn), sums.ggvv = total(ggvv);
  sums.gl = total(gl), sums.glu = total(gl * kColumn), sums.glv = total(glv);
  sums.gr = total(gr), sums.gru = total(gr * kColumn), sums.grv = total(grv);
  return sums;
}

constexpr float full_weight() {
  float sum = 0;
  for (int i = -kRadius; i <= kRadius; ++i) sum += falloff(static_cast<float>(i));
  return sum * sum;
}

void refine_cell(const Superposed& images, cv::Point at, Cell& cell) {
  const WindowSums sums = sums_around(images, at.x, at.y);
  cell.matched = sums.n > kMinFraction * full_weight() && sums.gg > kMinGradient * sums.n;
  Eigen::Vector3f step;
  if (!cell.matched || !(cell.matched = sums.solve(step, cell.correlation, cell.information))) return;
  cell.plane.d += step[0];
  cell.plane.dx += step[1];
  cell.plane.dy += step[2];
  cell.matched = cell.correlation > kMinCorrelation && std::abs(step[0]) <= kMaxStep_px &&
                 std::abs(cell.plane.dx) <= kSteepest && std::abs(cell.plane.dy) <= kSteepest;
}

}  // namespace

void refine_cells(const Level& left, const Level& right, CellGrid& grid) {
  const Superposed images = superpose(left, right, disparity_between_cells(grid, left.size));
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column)
      if (Cell& cell = grid.at(column, row); cell.matched)
        refine_cell(images, {column * CellGrid::kStep_px, row * CellGrid::kStep_px}, cell);
  });
}

}  // namespace palpate
