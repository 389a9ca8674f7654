#pragma once

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

struct SurfaceOptions {
  double spacing_mm = 0;        ///< distance between points of S*; 0 = from the resolution that n asks for
  double outlier_share = 0.02;  ///< fraction of points with the most isolated neighbourhoods that is dropped
  double largest_hole_mm = 15;  ///< holes with a rim shorter than pi times this are closed
};

void describe(Settings& settings, SurfaceOptions& options);

/// S -> points ready for Cocone: outliers removed, thinned to `spacing_mm`, smoothed along the surface (moving least
/// squares, weighted by each point's depth deviation) so that noise falls below a tenth of the spacing.
/// Throws BadInput when fewer than 50 points are left.
PointCloud clean_points(const PointCloud& cloud, double spacing_mm, const SurfaceOptions& options);

}  // namespace palpate
