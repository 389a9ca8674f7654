#pragma once

#include "palpate/elastic/tet_model.h"

namespace palpate {

/// The displacement of every node (3 n, mm) of a body that no instrument touches and whose fixed nodes are strained by
/// `strain` along x, y, z about `middle_mm`: equilibrium by Newton's method. It is also made the base of `model`, so
/// that unknowns count from it. Throws BadInput when the tissue has no equilibrium.
Eigen::VectorXd stretch_free_tissue(TetModel& model, const Vec3& strain, const Vec3& middle_mm);

}  // namespace palpate
