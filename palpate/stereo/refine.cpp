#include "palpate/stereo/refine.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace palpate {
namespace {

constexpr float kMostStep_px = 1.0f;
constexpr float kSteepest = 0.9f;
constexpr float kLeastCorrelation = 0.6f;
constexpr float kSameSurface_px = 0.7f;
constexpr float kLeastAgreement = 0.3f;   // of the neighbours, by weight
constexpr float kLeastNeighbours = 4.0f;  // by weight

using RefineWindow = Window<16>;

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

}  // namespace palpate
