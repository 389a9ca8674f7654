#pragma once

#include <array>

#include "palpate/elastic/tet_model.h"
#include "tests/support/dome.h"

namespace palpate::test {

/// A rigid disc on the top of the dome (E = 27 kPa, clamped below), tied to it and moved along its axis, and the force
/// on it by CalculiX with quadratic elements, refined until it changes by less than 0.7 %.
struct PunchReference {
  Law law;
  double poisson_ratio, radius_mm, displacement_mm;  ///< into the body where positive
  double force_N;
};

/// By `bench_elastic --references`.
inline constexpr std::array<PunchReference, 6> kPunchReferences = {{
    {Law::neo_hookean, 0.45, 3, -2, 0.4262},
    {Law::neo_hookean, 0.45, 3, 1.5, 0.3221},
    {Law::neo_hookean, 0.49, 3, -2, 0.4568},
    {Law::neo_hookean, 0.49, 3, 1.5, 0.3410},
    {Law::saint_venant_kirchhoff, 0.45, 3, -2, 0.6466},
    {Law::saint_venant_kirchhoff, 0.49, 3, -2, 0.7053},
}};

/// The dome filled with about so many elements, graded to edges of a third of the radius under the disc.
TetMesh graded_dome(int elements, double radius_mm);

/// The force that holds the disc, by EquilibriumSolver and Footprint; NaN where none is found.
double punch_force_N(const TetMesh& mesh, const PunchReference& punch, Element element);

/// The same by CalculiX with quadratic elements whose edges follow the disc's rim, `sectors` of them along a quarter.
double quadratic_punch_force_N(const PunchReference& punch, int sectors);

}  // namespace palpate::test
