#pragma once

#include "palpate/core/geometry.h"
#include "palpate/surface/depth_edges.h"

namespace palpate {

/// A surface out of candidate triangles that may overlap and branch: prunes fins, then walks from triangle to triangle
/// over shared edges, of several candidates always to the outermost (the one nearest to the camera at the origin). The
/// result is the largest component: edge-manifold, vertex-manifold, oriented towards the camera. Depends on the order
/// of the candidates only.
std::vector<Triangle> extract_manifold(const std::vector<Vec3>& points_mm, const std::vector<Triangle>& candidates);

/// Closes the holes of a vertex-manifold surface whose rim is shorter than `longest_rim_mm` with patches that continue
/// it smoothly; the longest rim is the outer boundary and stays open, and so does, with `edges`, a hole through which
/// something else is seen.
Surface close_holes(const Surface& surface, double longest_rim_mm, const DepthEdges* edges = nullptr);

}  // namespace palpate
