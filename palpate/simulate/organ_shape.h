#pragma once

#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// Closed surface of the organ at rest, left camera frame, oriented outwards, edge-manifold, with at least
/// `least_triangles`. The box of the named shapes measures exactly `size_mm` before they are turned.
/// Throws BadInput when a file cannot be used.
Surface make_organ(const SimulatedBody& body, int min_triangles);

/// Turn of the body by its `rotation_deg`.
Mat3 left_from_body(const SimulatedBody& body);

/// Unit sphere by repeated subdivision of an icosahedron.
Surface make_sphere(int subdivisions);

}  // namespace palpate
