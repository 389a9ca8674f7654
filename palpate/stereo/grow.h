#pragma once

#include <vector>

#include "palpate/stereo/seeds.h"
#include "palpate/stereo/window.h"

namespace palpate {

struct Cell {
  DisparityPlane plane;
  float correlation = 0;  ///< ZNCC of the windows under the plane
  float information = 0;  ///< inverse variance of the disparity, 1/px^2
  bool matched = false;
};

/// Matches on a grid over the left image; cell (i, j) stands at pixel (i, j) * kStep_px.
struct CellGrid {
  static constexpr int kStep_px = 4;
  int columns = 0;
  int rows = 0;
  std::vector<Cell> cells;

  Cell& at(int column, int row) { return cells[static_cast<size_t>(row * columns + column)]; }
  const Cell& at(int column, int row) const { return cells[static_cast<size_t>(row * columns + column)]; }
  bool holds(int column, int row) const { return column >= 0 && row >= 0 && column < columns && row < rows; }
};

/// Best-first region growing (Lhuillier, Quan 2002; Stoyanov 2010): the match with the highest correlation hands its
/// disparity plane to the neighbours, each fits the plane to its own window (Gauss-Newton, gain and offset free) and is
/// accepted when the correlation is high and the disparity changes no faster than the limit. The best few hundred hand
/// on together, so that their neighbours are tried in parallel. Works on images half as large with cells twice as far
/// apart; each match has to be found again from the right image, and the cells of the grid take the nearest plane.
CellGrid grow(const PreparedPair& prepared, const Seeds& seeds, double min_disparity_px, double max_disparity_px);

}  // namespace palpate
