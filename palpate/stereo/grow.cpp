#include "palpate/stereo/grow.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <queue>

namespace palpate {
namespace {

// Growing works on images half as large: their windows see twice as far, and a sixteen-byte-wide row of eight pixels
// fits one vector register.
constexpr int kLanes = 8;
constexpr int kRadius = 3;
constexpr int kRows = 2 * kRadius + 1;
constexpr float kLeastCorrelation = 0.6f;
constexpr float kLeastSeedCorrelation = 0.8f;
constexpr float kMostStep = 0.75f;   // half-size px from the prediction of a neighbour
constexpr float kSteepest = 0.8f;    // disparity gradient limit
constexpr float kMostReturn = 0.5f;  // half-size px, left-right check
constexpr int kSmallestIsland = 60;  // cells

struct Half {
  cv::Mat grey;
  cv::Mat gradient;
  cv::Mat mask;  // CV_32F, 0 or 1
};

Half halve(const cv::Mat& grey, const cv::Mat& mask) {
  Half half;
  cv::Mat small_mask;
  cv::pyrDown(grey, half.grey);
  cv::resize(mask, small_mask, half.grey.size(), 0, 0, cv::INTER_NEAREST);
  small_mask.convertTo(half.mask, CV_32F, 1.0 / 255);
  cv::Sobel(half.grey, half.gradient, CV_32F, 1, 0, cv::FILTER_SCHARR, 1.0 / 32);
  return half;
}

using Lane = float[kLanes];

float sum_of(const Lane& lane) {
  float sum = 0;
  for (const float value : lane) sum += value;
  return sum;
}

// The window of one pixel of `from`: centred grey levels, gradient and weights, and the normal matrix of the plane.
struct Window {
  Lane grey[kRows];
  Lane jacobian[3][kRows];
  Lane weight[kRows];
  Eigen::Matrix3f inverse;
  float weights = 0;
  float variance = 0;  // weighted sum of squares of the grey levels

  bool cut(const Half& from, cv::Point at);
};

constexpr float kColumnWeight[kLanes] = {0.45f, 0.7f, 0.9f, 1, 0.9f, 0.7f, 0.45f, 0};

bool Window::cut(const Half& from, cv::Point at) {
  if (at.x < kRadius || at.y < kRadius || at.x + kLanes - kRadius > from.grey.cols || at.y + kRadius >= from.grey.rows)
    return false;
  Lane w_sum = {}, wl_sum = {}, wg_sum = {}, wgu_sum = {}, wgv_sum = {};
  for (int r = 0; r < kRows; ++r) {
    const int y = at.y + r - kRadius;
    const float* l = from.grey.ptr<float>(y) + at.x - kRadius;
    const float* g = from.gradient.ptr<float>(y) + at.x - kRadius;
    const float* m = from.mask.ptr<float>(y) + at.x - kRadius;
    const float v = static_cast<float>(r - kRadius);
    for (int i = 0; i < kLanes; ++i) {
      const float u = static_cast<float>(i - kRadius);
      const float w = m[i] * kColumnWeight[i] * kColumnWeight[r];
      weight[r][i] = w;
      grey[r][i] = l[i];
      jacobian[0][r][i] = g[i];
      jacobian[1][r][i] = g[i] * u;
      jacobian[2][r][i] = g[i] * v;
      w_sum[i] += w;
      wl_sum[i] += w * l[i];
      wg_sum[i] += w * g[i];
      wgu_sum[i] += w * g[i] * u;
      wgv_sum[i] += w * g[i] * v;
    }
  }
  weights = sum_of(w_sum);
  if (weights < 8) return false;
  const float mean = sum_of(wl_sum) / weights;
  const float means[3] = {sum_of(wg_sum) / weights, sum_of(wgu_sum) / weights, sum_of(wgv_sum) / weights};
  Lane square = {}, normal[6] = {};
  for (int r = 0; r < kRows; ++r)
    for (int i = 0; i < kLanes; ++i) {
      const float w = weight[r][i];
      grey[r][i] -= mean;
      square[i] += w * grey[r][i] * grey[r][i];
      const float a = jacobian[0][r][i] -= means[0];
      const float b = jacobian[1][r][i] -= means[1];
      const float c = jacobian[2][r][i] -= means[2];
      normal[0][i] += w * a * a, normal[1][i] += w * a * b, normal[2][i] += w * a * c;
      normal[3][i] += w * b * b, normal[4][i] += w * b * c, normal[5][i] += w * c * c;
    }
  variance = sum_of(square);
  // A weak belief in the predicted slopes: one grey level of noise against a deviation of 0.1.
  constexpr float kSlopeBelief = 1 / (0.1f * 0.1f);
  Eigen::Matrix3f H;
  const float h01 = sum_of(normal[1]), h02 = sum_of(normal[2]), h12 = sum_of(normal[4]);
  H << sum_of(normal[0]), h01, h02, h01, sum_of(normal[3]) + kSlopeBelief, h12, h02, h12,
      sum_of(normal[5]) + kSlopeBelief;
  if (H(0, 0) < 4) return false;  // no texture along the row
  inverse = H.inverse();
  return true;
}

// One look at the other image under a plane: the downhill direction, and the correlation.
struct Look {
  Eigen::Vector3f slope = Eigen::Vector3f::Zero();
  float correlation = -1;
};

bool look(const Window& window, const Half& to, cv::Point at, const DisparityPlane& plane, Look& result) {
  // Corners decide whether all of the window is inside.
  const float reach = kRadius + 1;
  const float spread = std::abs(plane.dx) * reach + std::abs(plane.dy) * reach;
  const float left_end = static_cast<float>(at.x) - reach - plane.d - spread;
  const float right_end = static_cast<float>(at.x) + reach + 2 - plane.d + spread;
  if (!(left_end >= 0 && right_end < static_cast<float>(to.grey.cols))) return false;
  Lane values[kRows];
  Lane w_r = {};
  for (int r = 0; r < kRows; ++r) {
    const float* row = to.grey.ptr<float>(at.y + r - kRadius);
    const float start =
        static_cast<float>(at.x - kRadius) - plane.d - plane.dy * static_cast<float>(r - kRadius) + plane.dx * kRadius;
    for (int i = 0; i < kLanes; ++i) {
      const float x = start + static_cast<float>(i) * (1 - plane.dx);
      const int whole = static_cast<int>(x);
      const float part = x - static_cast<float>(whole);
      values[r][i] = row[whole] + part * (row[whole + 1] - row[whole]);
      w_r[i] += window.weight[r][i] * values[r][i];
    }
  }
  const float mean = sum_of(w_r) / window.weights;
  Lane square = {}, product = {}, j_r[3] = {}, j_l[3] = {};
  for (int r = 0; r < kRows; ++r)
    for (int i = 0; i < kLanes; ++i) {
      const float value = values[r][i] - mean;
      const float wv = window.weight[r][i] * value, wl = window.weight[r][i] * window.grey[r][i];
      square[i] += wv * value;
      product[i] += wv * window.grey[r][i];
      for (int k = 0; k < 3; ++k) {
        j_r[k][i] += wv * window.jacobian[k][r][i];
        j_l[k][i] += wl * window.jacobian[k][r][i];
      }
    }
  const float rr = sum_of(square), lr = sum_of(product);
  if (rr < 1e-3f || window.variance < 1e-3f) return false;
  result.correlation = lr / std::sqrt(rr * window.variance);
  const float gain = std::sqrt(window.variance / rr);
  for (int k = 0; k < 3; ++k) result.slope[k] = sum_of(j_l[k]) - gain * sum_of(j_r[k]);
  return true;
}

// Gauss-Newton from a predicted plane. The template's gradient stands for that of the other image, so that the normal
// matrix is inverted once.
bool fit(const Half& from, const Half& to, cv::Point at, DisparityPlane& plane, float& correlation) {
  Window window;
  if (!window.cut(from, at)) return false;
  const DisparityPlane predicted = plane;
  Look here;
  for (int iteration = 0; iteration < 5; ++iteration) {
    if (!look(window, to, at, plane, here)) return false;
    if (here.correlation < 0) return false;
    const Eigen::Vector3f step = -(window.inverse * here.slope);
    plane.d += step[0];
    plane.dx += step[1];
    plane.dy += step[2];
    if (!(std::abs(plane.d - predicted.d) <= kMostStep && std::abs(plane.dx) <= kSteepest &&
          std::abs(plane.dy) <= kSteepest))
      return false;
    if (std::abs(step[0]) < 0.02f) break;
  }
  correlation = here.correlation;
  return true;
}

class Grower {
 public:
  Grower(const Eyes& eyes, double least, double most)
      : left_(halve(eyes.left, eyes.left_mask)),
        right_(halve(eyes.right, eyes.right_mask)),
        least_(static_cast<float>(least / 2)),
        most_(static_cast<float>(most / 2)) {
    grid_.columns = (eyes.left.cols + CellGrid::kStep_px - 1) / CellGrid::kStep_px;
    grid_.rows = (eyes.left.rows + CellGrid::kStep_px - 1) / CellGrid::kStep_px;
    grid_.cells.resize(static_cast<size_t>(grid_.columns * grid_.rows));
  }

  CellGrid run(const Seeds& seeds) {
    for (const Seed& seed : seeds.matches) {
      const int column = cvRound(seed.left_px.x / CellGrid::kStep_px),
                row = cvRound(seed.left_px.y / CellGrid::kStep_px);
      try_cell(column, row, {seed.disparity_px / 2, 0, 0}, kLeastSeedCorrelation);
    }
    while (!queue_.empty()) {
      const int index = queue_.top().second;
      queue_.pop();
      spread(index % grid_.columns, index / grid_.columns);
    }
    check_from_the_right();
    drop_islands();
    for (Cell& cell : grid_.cells) cell.plane.d *= 2;  // slopes are the same at every size
    return std::move(grid_);
  }

 private:
  static constexpr int kHalfStep = CellGrid::kStep_px / 2;

  void spread(int column, int row) {
    const DisparityPlane from = grid_.at(column, row).plane;
    for (const auto& [i, j] : {std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, -1}, std::pair{0, 1}}) {
      const float shift = kHalfStep * (static_cast<float>(i) * from.dx + static_cast<float>(j) * from.dy);
      try_cell(column + i, row + j, {from.d + shift, from.dx, from.dy}, kLeastCorrelation);
    }
  }

  void try_cell(int column, int row, DisparityPlane plane, float least_correlation) {
    if (column < 0 || row < 0 || column >= grid_.columns || row >= grid_.rows) return;
    Cell& cell = grid_.at(column, row);
    const cv::Point at(column * kHalfStep, row * kHalfStep);
    if (cell.matched || at.x >= left_.mask.cols || at.y >= left_.mask.rows || left_.mask.at<float>(at) == 0) return;
    float correlation = 0;
    if (!fit(left_, right_, at, plane, correlation) || correlation < least_correlation) return;
    if (plane.d < least_ || plane.d > most_) return;
    cell = {plane, correlation, true};
    queue_.emplace(correlation, row * grid_.columns + column);
  }

  void check_from_the_right() {
    std::vector<char> confirmed(grid_.cells.size(), 0);
    tbb::parallel_for(0, grid_.rows, [&](int row) {
      for (int column = 0; column < grid_.columns; ++column)
        if (grid_.at(column, row).matched)
          confirmed[static_cast<size_t>(row * grid_.columns + column)] = found_again(column, row);
    });
    for (size_t i = 0; i < confirmed.size(); ++i) grid_.cells[i].matched = confirmed[i];
  }

  // Seen from the right pixel u' = u - d(u), the plane reads d' = d0 + dx (u - u0), u = (u' + ...) / (1 - dx).
  bool found_again(int column, int row) const {
    const DisparityPlane& plane = grid_.at(column, row).plane;
    const float x = static_cast<float>(column * kHalfStep) - plane.d;
    const cv::Point at(cvRound(x), row * kHalfStep);
    const float stretch = 1 / (1 - plane.dx);
    const float off = (static_cast<float>(at.x) - x) * stretch;
    const DisparityPlane expected{-(plane.d + plane.dx * off), -plane.dx * stretch, -plane.dy * stretch};
    DisparityPlane seen = expected;
    float correlation = 0;
    return fit(right_, left_, at, seen, correlation) && std::abs(seen.d - expected.d) < kMostReturn;
  }

  void drop_islands() {
    std::vector<char> visited(grid_.cells.size(), 0);
    for (int start = 0; start < static_cast<int>(grid_.cells.size()); ++start) {
      if (visited[static_cast<size_t>(start)] || !grid_.cells[static_cast<size_t>(start)].matched) continue;
      std::vector<int> island{start};
      visited[static_cast<size_t>(start)] = 1;
      for (size_t k = 0; k < island.size(); ++k) visit_neighbours(island[k], visited, island);
      if (island.size() >= kSmallestIsland) continue;
      for (const int index : island) grid_.cells[static_cast<size_t>(index)].matched = false;
    }
  }

  void visit_neighbours(int index, std::vector<char>& visited, std::vector<int>& island) const {
    const int column = index % grid_.columns, row = index / grid_.columns;
    const float d = grid_.at(column, row).plane.d;
    for (const auto& [i, j] : {std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, -1}, std::pair{0, 1}}) {
      const int c = column + i, r = row + j;
      if (c < 0 || r < 0 || c >= grid_.columns || r >= grid_.rows) continue;
      const size_t next = static_cast<size_t>(r * grid_.columns + c);
      if (visited[next] || !grid_.cells[next].matched) continue;
      if (std::abs(grid_.cells[next].plane.d - d) > 2 * kSteepest * kHalfStep) continue;
      visited[next] = 1;
      island.push_back(static_cast<int>(next));
    }
  }

  Half left_;
  Half right_;
  float least_;
  float most_;
  CellGrid grid_;
  std::priority_queue<std::pair<float, int>> queue_;
};

}  // namespace

CellGrid grow(const Eyes& eyes, const Seeds& seeds, double least_disparity_px, double most_disparity_px) {
  return Grower(eyes, least_disparity_px, most_disparity_px).run(seeds);
}

}  // namespace palpate
