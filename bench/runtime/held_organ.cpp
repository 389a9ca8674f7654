#include "bench/runtime/held_organ.h"

#include <algorithm>
#include <map>

#include "palpate/simulate/organ_shape.h"
#include "palpate/volume/tetrahedralize.h"

namespace palpate::bench {

namespace {

/// Edges under the footprint against those elsewhere, as a map refined at onset has them.
constexpr double kEdgeRatio = 0.3;
constexpr double kHeldFraction = 0.3;

HeldOrgan make_organ_of(int elements) {
  HeldOrgan organ;
  const Surface body = make_organ(SimulatedBody(), 20000);
  const auto nearest = std::min_element(body.vertices_mm.begin(), body.vertices_mm.end(),
                                        [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  const auto farthest = std::max_element(body.vertices_mm.begin(), body.vertices_mm.end(),
                                         [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  organ.touch_mm = *nearest;
  organ.mesh = tetrahedralize(body, elements, MeshFocus{*nearest, kFootprintRadius_mm, kEdgeRatio});
  const double clamped_from_mm = farthest->z() - kHeldFraction * (farthest->z() - nearest->z());
  for (size_t n = 0; n < organ.mesh.nodes_mm.size(); ++n)
    if (organ.mesh.nodes_mm[n].z() > clamped_from_mm) organ.fixed_nodes.push_back(static_cast<int>(n));
  organ.boundary = boundary_triangles(organ.mesh);
  return organ;
}

}  // namespace

TetModel HeldOrgan::model(Element element, Law law) const {
  return TetModel(mesh, {law, 27, 0.45, ""}, fixed_nodes, element);
}

const HeldOrgan& held_organ(int elements) {
  static std::map<int, HeldOrgan> organs;
  const auto found = organs.find(elements);
  return found != organs.end() ? found->second : organs.emplace(elements, make_organ_of(elements)).first->second;
}

}  // namespace palpate::bench
