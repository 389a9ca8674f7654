#pragma once

#include "palpate/surface/clean_points.h"
#include "palpate/surface/depth_edges.h"

namespace palpate {

/// A surface that hangs together; depth edges part it from others.
struct SurfacePiece {
  Surface surface;
  PointCloud clean;     ///< its points, cleaned and thinned
  double area_mm2 = 0;  ///< as it faces the camera
  double depth_mm = 0;  ///< median of its vertices
};

/// The points that hang together without crossing an edge, most of them first; where an instrument hides the surface,
/// points that continue it. Groups that cover less than `edges.options.min_piece_mm2`, and points on the edges
/// themselves, are left out. Throws BadInput when nothing is left.
std::vector<PointCloud> split_at_edges(const PointCloud& cloud, const DepthEdges& edges);

/// S* of each group: clean_points, cocone (which cuts also where an edge ends inside the group), extend_rim; what is
/// left of a group, again. The largest surface first. Throws BadInput when there is none.
std::vector<SurfacePiece> cut_surfaces(std::vector<PointCloud> groups, const DepthEdges& edges, double spacing_mm,
                                       const SurfaceOptions& options);

}  // namespace palpate
