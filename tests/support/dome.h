#pragma once

#include <vector>

#include "palpate/core/geometry.h"

namespace palpate::test {

/// An organ of about 46 cm^3 whose shape is known exactly: over an ellipse with these half axes stands a wall of
/// `wall_mm`, on it a paraboloid whose top is at the origin; z goes into the body, its flat underside is at z =
/// depth_mm.
struct Dome {
  double half_length_mm = 35, half_width_mm = 28, depth_mm = 30, wall_mm = 10;

  double top_z_mm(double x, double y) const;
};

/// Closed, oriented outwards, edges of about `edge_mm` at most.
Surface dome_surface(const Dome& dome, double edge_mm);

/// The quarter x, y >= 0, graded towards the rim of the disc x^2 + y^2 <= radius^2 and towards the top; `sectors` edges
/// along the quarter of the disc's rim, which element edges follow.
TetMesh quarter_dome(const Dome& dome, double radius_mm, int sectors);

}  // namespace palpate::test
