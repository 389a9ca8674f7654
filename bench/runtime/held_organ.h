#pragma once

#include <vector>

#include "palpate/contact/footprint.h"
#include "palpate/elastic/tet_model.h"

namespace palpate::bench {

constexpr double kFootprintRadius_mm = 3;

/// A pear of 62 x 48 x 44 mm that looks at the camera, clamped behind, with edges graded towards the place where it is
/// touched.
struct HeldOrgan {
  TetMesh mesh;
  std::vector<int> fixed_nodes;
  std::vector<Triangle> boundary;
  Vec3 touch_mm = Vec3::Zero();

  TetModel model(Element element, Law law = Law::saint_venant_kirchhoff) const;
};

/// The same organ for the same count; made once.
const HeldOrgan& held_organ(int elements);

}  // namespace palpate::bench
