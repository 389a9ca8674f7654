#pragma once

#include "palpate/stereo/grow.h"
#include "palpate/stereo/match.h"

namespace palpate {

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
