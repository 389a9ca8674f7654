#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

enum class Law { saint_venant_kirchhoff, saint_venant_kirchhoff_barrier, neo_hookean, corotated, linear };

/// Constants of one tissue among several; the law is the same for all.
struct Stiffness {
  double young_modulus_kPa = 0;
  double poisson_ratio = 0.45;
};

/// gamma of the paper. Inside, stress is N/mm^2 = MPa.
struct TissueOptions {
  Law law = Law::saint_venant_kirchhoff;
  double young_modulus_kPa = 0;
  double poisson_ratio = 0.45;
  std::string preset;  ///< liver, uterus, ...; fills the two numbers above where they are not given

  /// Of the elements with label 1, 2, ...; elements with label 0, or with one that is not here, have the two above.
  std::vector<Stiffness> of_label = {};

  bool modulus_unknown = false;  ///< E is 1 kPa then, forces are N per kPa, stress is a ratio to E

  double young_modulus_MPa() const { return young_modulus_kPa * 1e-3; }
};

void describe(Settings& settings, TissueOptions& options);

/// What a force, a stress counts in: "N", "kPa"; where the modulus is unknown "N/kPa", "of E".
std::string force_unit(const TissueOptions& tissue);
std::string stress_unit(const TissueOptions& tissue);
/// "27 kPa", "unknown".
std::string modulus_text(const TissueOptions& tissue);

/// Every law with its name in the scene file: "saint-venant-kirchhoff".
const std::vector<std::pair<std::string, Law>>& law_words();
std::string law_name(Law law);

using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Lame parameters, MPa.
struct Lame {
  double lambda = 0;
  double mu = 0;
  double barrier = 0;  ///< beta of saint-venant-kirchhoff-barrier
};
Lame lame_of(const TissueOptions& tissue);
/// The one of elements with this label.
Lame lame_of(const TissueOptions& tissue, int label);

/// Strain energy per rest volume, N mm / mm^3.
///   saint-venant-kirchhoff: lambda/2 tr(E)^2 + mu E:E
///   saint-venant-kirchhoff-barrier: the same, and where J = det F < 1 also -beta (J - 1)^2 ln J, beta = (lambda + 2
///   mu) / 20, with which free and confined compression stiffen all the way for every Poisson's ratio
///   neo-hookean:            mu/2 (J^-2/3 tr(F^T F) - 3) + kappa/2 (J - 1)^2, kappa = lambda + 2/3 mu (Abaqus,
///   CalculiX)
///   corotated:              lambda/2 tr(S - I)^2 + mu |S - I|^2 with F = R S, R a rotation also where F is inverted
///   (Mueller and Gross 2004; with tr(S - I)^2, not (J - 1)^2, so that it is Hooke's law in the rotated frame)
///   linear:                 lambda/2 tr(eps)^2 + mu eps:eps, eps = sym(F) - I
double energy_density(Law law, const Lame& lame, const Mat3& F);

/// First Piola-Kirchhoff stress dW/dF, MPa.
Mat3 first_piola_stress(Law law, const Lame& lame, const Mat3& F);

/// dP/dF as a 9 x 9 matrix on column-major vec(F), MPa.
Mat9 stress_derivative(Law law, const Lame& lame, const Mat3& F);

/// Every law holds the change of volume by kappa/2 (theta - 1)^2, where theta is J (neo-hookean) or the same to first
/// order: 1 + tr(E), 1 + tr(S - I), 1 + tr(eps). What is left of a law without it is the law of `without_bulk(lame)`.
double bulk_modulus(const Lame& lame);
Lame without_bulk(const Lame& lame);
double volume_ratio(Law law, const Mat3& F);
/// d theta / dF.
Mat3 volume_ratio_gradient(Law law, const Mat3& F);
/// d^2 theta / dF^2 on column-major vec(F).
Mat9 volume_ratio_curvature(Law law, const Mat3& F);

/// Whether the law means something at F; beyond, its answer is not to be trusted.
///   saint-venant-kirchhoff: every stretch above 1/sqrt(3), below which more compression takes less force; with its
///   barrier the same
///   neo-hookean:            not inverted
///   corotated:              not inverted, and the sum of any two stretches above 1, below which shear has no stiffness
///   linear:                 |F - I| <= 0.1: strain and rotation are small
bool in_valid_range(Law law, const Mat3& F);

/// Whether the energy grows without bound before an element is inverted.
bool resists_inversion(Law law);

/// P F^T / J, MPa; of the linear law, which does not tell the two states apart, P.
Mat3 cauchy_stress(Law law, const Lame& lame, const Mat3& F);

}  // namespace palpate
