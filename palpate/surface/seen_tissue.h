#pragma once

#include "palpate/surface/depth_cells.h"

namespace palpate {

/// Which places of the body were seen: S* over the image plane of the camera at the origin.
struct SeenTissue {
  enum class Sight { none, closed, seen };

  DepthCells cells;        ///< w of S*; closed = continued behind an instrument
  cv::Mat1f inside_cells;  ///< distance of each cell from where S* ends, in cells
};

/// `closed` of `measured` tells where S* only continues what surrounds it.
SeenTissue seen_tissue(const Surface& surface, const DepthCells& measured);

/// Whether S* passes within `reach_mm` of a place, and whether the nearest of it was seen.
SeenTissue::Sight sight_of(const SeenTissue& seen, const Vec3& place_mm, double reach_mm);

/// Of a place on S* from where S* ends, as the camera sees it; 0 outside.
double distance_to_edge_mm(const SeenTissue& seen, const Vec3& place_mm);

}  // namespace palpate
