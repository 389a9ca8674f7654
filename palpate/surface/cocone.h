#pragma once

#include "palpate/core/geometry.h"
#include "palpate/surface/clean_points.h"
#include "palpate/surface/depth_edges.h"

namespace palpate {

/// S* of the paper by Cocone (Amenta, Choi, Dey, Leekha 2002; the paper's [17]): Delaunay triangulation, poles, cocone
/// test on the dual Voronoi edges, manifold extraction. The result is edge-manifold, one component, oriented towards
/// the camera (origin), its outer boundary open; holes up to `options.largest_hole_mm` are closed. With `edges` no face
/// crosses one of them, and a hole through which something else is seen stays open. Throws BadInput when no surface
/// results.
Surface cocone(const std::vector<Vec3>& points_mm, const SurfaceOptions& options, const DepthEdges* edges = nullptr);

}  // namespace palpate
