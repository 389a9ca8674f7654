#include "palpate/elastic/material.h"

#include <cmath>

#include "palpate/elastic/laws.h"

namespace palpate {

using laws::with_law;

double energy_density(Law law, const Lame& lame, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.energy_density(lame, F); });
}

Mat3 first_piola_stress(Law law, const Lame& lame, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.first_piola_stress(lame, F); });
}

Mat9 stress_derivative(Law law, const Lame& lame, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.stress_derivative(lame, F); });
}

double bulk_modulus(const Lame& lame) {
  return lame.lambda + 2.0 / 3.0 * lame.mu;
}

Lame without_bulk(const Lame& lame) {
  return {-2.0 / 3.0 * lame.mu, lame.mu, lame.barrier};
}

double volume_ratio(Law law, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.volume_ratio(F); });
}

Mat3 volume_ratio_gradient(Law law, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.volume_ratio_gradient(F); });
}

Mat9 volume_ratio_curvature(Law law, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.volume_ratio_curvature(F); });
}

bool in_valid_range(Law law, const Mat3& F) {
  return with_law(law, [&](auto l) { return l.in_valid_range(F); });
}

bool resists_inversion(Law law) {
  return law == Law::saint_venant_kirchhoff_barrier || law == Law::neo_hookean;
}

Mat3 cauchy_stress(Law law, const Lame& lame, const Mat3& F) {
  const Mat3 P = first_piola_stress(law, lame, F);
  return law == Law::linear ? P : Mat3(P * F.transpose() / F.determinant());
}

}  // namespace palpate
