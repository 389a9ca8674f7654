#pragma once

#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/surface/depth_edges.h"

namespace palpate {

/// The surface with its open rim moved out to where measured points end. Thinning leaves the rim of S* half a spacing
/// inside of what was seen; a body that is closed behind it would be that much too slim. `measured_mm`: all points,
/// before thinning; a vertex of the rim moves by at most `reach_mm`, along the surface, and less where a face would
/// then stand before something else that is seen (`edges`).
Surface extend_rim(Surface surface, const std::vector<Vec3>& measured_mm, double reach_mm,
                   const DepthEdges* edges = nullptr);

}  // namespace palpate
