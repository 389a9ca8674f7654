#pragma once

#include <cmath>

#include "palpate/stereo/grow.h"
#include "palpate/stereo/match.h"

namespace palpate {

/// One standard deviation of a disparity of which a window says `information` (1/px^2): never below 0.02 px, and
/// `noise_spread` times what independent noise would leave.
inline float deviation_px(float information, float noise_spread) {
  return std::hypot(0.02f, noise_spread / std::sqrt(information));
}

/// Fits every matched cell again at full size with larger windows (sub-pixel refinement).
void refine_cells(const Eyes& eyes, CellGrid& grid);

/// Moving least squares: the plane of every matched cell from its neighbours on the same surface, weighted by their
/// information.
void smooth_cells(CellGrid& grid);

/// Disparity, deviation and correlation of every pixel of the left mask from the planes of the cells around it; at a
/// step of depth the surface whose small window fits better takes the pixel.
DisparityMap fill_between_cells(const Eyes& eyes, const CellGrid& grid);

/// Correlation and deviation of a disparity found by other means.
DisparityMap measure(const Eyes& eyes, const cv::Mat& disparity_px);

}  // namespace palpate
