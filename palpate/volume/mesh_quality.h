#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// The largest set of tetrahedra connected over faces; nodes used by none are dropped.
TetMesh largest_piece(const TetMesh& mesh);

}  // namespace palpate
