#pragma once

#include <cmath>

#include "palpate/stereo/grow.h"
#include "palpate/stereo/match.h"

namespace palpate {

/// One standard deviation of a disparity of which a window says `information` (1/px^2), never below 0.02 px.
inline float deviation_px(float information) {
  return std::sqrt(0.02f * 0.02f + 1 / information);
}

/// Disparity of every pixel (CV_32F) from the planes of the cells around it, NaN where none is matched.
cv::Mat disparity_between_cells(const CellGrid& grid, cv::Size size);

/// Sub-pixel refinement: the right image is drawn where the disparity says that the left one sees it, and each matched
/// cell takes the step that brings its window of both into line.
void refine_cells(const Level& left, const Level& right, CellGrid& grid);

/// Cells that smoothing looks at: up to `radius` cells away, every `step`-th of them.
struct Reach {
  int radius = 5;
  int step = 1;
};

/// Moving least squares: the plane of every matched cell, and how well it is known, from a quadratic through its
/// neighbours on the same surface, weighted by their information. Cells that their neighbours contradict are dropped.
void smooth_cells(CellGrid& grid, Reach reach);

/// Disparity, deviation and correlation of every pixel of the left mask from the planes of the cells around it; at a
/// step of depth the surface whose small window fits better takes the pixel.
DisparityMap fill_between_cells(const PreparedPair& prepared, const CellGrid& grid);

/// Correlation and deviation of a disparity found by other means.
DisparityMap measure(const PreparedPair& prepared, const cv::Mat& disparity_px);

}  // namespace palpate
