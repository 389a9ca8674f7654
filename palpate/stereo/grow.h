#pragma once

#include <vector>

#include "palpate/stereo/seeds.h"

namespace palpate {

/// Disparity around one cell of the grid, as a plane: d + dx u + dy v at (u, v) px from the cell's pixel.
struct DisparityPlane {
  float d = 0;
  float dx = 0;
  float dy = 0;
};

struct Cell {
  DisparityPlane plane;
  float correlation = 0;  ///< ZNCC of the windows under the plane
  bool matched = false;
};

/// Matched cells on a grid over the left image; cell (i, j) stands at pixel (i, j) * kCellStep_px.
struct CellGrid {
  static constexpr int kStep_px = 4;
  int columns = 0;
  int rows = 0;
  std::vector<Cell> cells;

  Cell& at(int column, int row) { return cells[static_cast<size_t>(row * columns + column)]; }
  const Cell& at(int column, int row) const { return cells[static_cast<size_t>(row * columns + column)]; }
};

/// Best-first region growing (Lhuillier, Quan 2002; Stoyanov 2010): the match with the highest correlation hands its
/// disparity plane to the neighbours, each fits the plane to its own window (Gauss-Newton, gain and offset free) and is
/// accepted when the correlation is high and the disparity changes no faster than the limit. Afterwards each match has
/// to be found again from the right image, and islands too small to be trusted are dropped.
CellGrid grow(const Eyes& eyes, const Seeds& seeds, double least_disparity_px, double most_disparity_px);

}  // namespace palpate
