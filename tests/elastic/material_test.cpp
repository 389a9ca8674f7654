#include "palpate/elastic/material.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "palpate/elastic/stress.h"

namespace palpate {
namespace {

const Law kLaws[] = {Law::saint_venant_kirchhoff, Law::saint_venant_kirchhoff_barrier, Law::neo_hookean, Law::corotated,
                     Law::linear};

Lame liver() {
  return lame_of({Law::saint_venant_kirchhoff, 27, 0.45, ""});
}

Mat3 random_gradient(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-0.25, 0.25);
  Mat3 F = Mat3::Identity();
  for (int i = 0; i < 9; ++i) F.data()[i] += uniform(random);
  return F;
}

TEST(Material, LameConstantsGiveBackYoungsModulusAndPoissonsRatio) {
  const Lame lame = liver();
  const double E = lame.mu * (3 * lame.lambda + 2 * lame.mu) / (lame.lambda + lame.mu);
  EXPECT_NEAR(E, 0.027, 1e-12);
  EXPECT_NEAR(lame.lambda / (2 * (lame.lambda + lame.mu)), 0.45, 1e-12);
}

TEST(Material, StressIsTheGradientOfTheEnergy) {
  std::mt19937 random(1);
  for (Law law : kLaws)
    for (int trial = 0; trial < 20; ++trial) {
      SCOPED_TRACE(law_name(law));
      const Mat3 F = random_gradient(random);
      const Mat3 P = first_piola_stress(law, liver(), F);
      for (int i = 0; i < 9; ++i) {
        Mat3 plus = F, minus = F;
        plus.data()[i] += 1e-6;
        minus.data()[i] -= 1e-6;
        const double slope = (energy_density(law, liver(), plus) - energy_density(law, liver(), minus)) / 2e-6;
        EXPECT_NEAR(slope, P.data()[i], 1e-7 * P.norm() + 1e-11);
      }
    }
}

TEST(Material, TangentIsTheDerivativeOfTheStressAndSymmetric) {
  std::mt19937 random(2);
  for (Law law : kLaws)
    for (int trial = 0; trial < 20; ++trial) {
      SCOPED_TRACE(law_name(law));
      const Mat3 F = random_gradient(random);
      const Mat9 C = stress_derivative(law, liver(), F);
      EXPECT_LT((C - C.transpose()).norm(), 1e-12 * C.norm());
      for (int i = 0; i < 9; ++i) {
        Mat3 plus = F, minus = F;
        plus.data()[i] += 1e-6;
        minus.data()[i] -= 1e-6;
        const Mat3 slope = (first_piola_stress(law, liver(), plus) - first_piola_stress(law, liver(), minus)) / 2e-6;
        EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 9, 1>>(slope.data()) - C.col(i)).norm(), 1e-7 * C.norm());
      }
    }
}

TEST(Material, TheVolumeRatioAndItsDerivativesBelongTogether) {
  std::mt19937 random(4);
  for (Law law : kLaws)
    for (int trial = 0; trial < 20; ++trial) {
      SCOPED_TRACE(law_name(law));
      const Mat3 F = random_gradient(random), G = volume_ratio_gradient(law, F);
      const Mat9 C = volume_ratio_curvature(law, F);
      for (int i = 0; i < 9; ++i) {
        Mat3 plus = F, minus = F;
        plus.data()[i] += 1e-5;
        minus.data()[i] -= 1e-5;
        EXPECT_NEAR((volume_ratio(law, plus) - volume_ratio(law, minus)) / 2e-5, G.data()[i], 1e-9);
        const Mat3 slope = (volume_ratio_gradient(law, plus) - volume_ratio_gradient(law, minus)) / 2e-5;
        EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 9, 1>>(slope.data()) - C.col(i)).norm(), 1e-9);
      }
    }
}

TEST(Material, TheBulkEnergyAndTheRestMakeTheWholeLaw) {
  std::mt19937 random(5);
  for (Law law : kLaws) {
    const Mat3 F = random_gradient(random);
    const double growth = volume_ratio(law, F) - 1;
    EXPECT_NEAR(energy_density(law, without_bulk(liver()), F) + 0.5 * bulk_modulus(liver()) * growth * growth,
                energy_density(law, liver(), F), 1e-15);
  }
}

TEST(Material, ARotationCarriesTheStressAlong) {
  std::mt19937 random(3);
  const Mat3 R = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (Law law : {Law::saint_venant_kirchhoff, Law::saint_venant_kirchhoff_barrier, Law::neo_hookean, Law::corotated}) {
    SCOPED_TRACE(law_name(law));
    EXPECT_LT(first_piola_stress(law, liver(), R).norm(), 1e-15);
    const Mat3 F = random_gradient(random);
    const Mat3 turned = cauchy_stress(law, liver(), R * F),
               expected = R * cauchy_stress(law, liver(), F) * R.transpose();
    EXPECT_LT((turned - expected).norm(), 1e-12 * expected.norm());
    EXPECT_NEAR(energy_density(law, liver(), R * F), energy_density(law, liver(), F), 1e-15);
  }
}

TEST(Material, AllLawsAgreeWithHookesLawAtSmallStrain) {
  Mat3 strain;
  strain << 1, 0.3, -0.2, 0.3, -2, 0.5, -0.2, 0.5, 0.7;
  strain *= 1e-7;
  const Lame lame = liver();
  const Mat3 hooke = lame.lambda * strain.trace() * Mat3::Identity() + 2 * lame.mu * strain;
  const Mat9 stiffness = stress_derivative(Law::linear, lame, Mat3::Identity());
  for (Law law : kLaws) {
    SCOPED_TRACE(law_name(law));
    EXPECT_LT((cauchy_stress(law, lame, Mat3::Identity() + strain) - hooke).norm(), 1e-5 * hooke.norm());
    EXPECT_LT((stress_derivative(law, lame, Mat3::Identity()) - stiffness).norm(), 1e-12 * stiffness.norm());
  }
}

TEST(Material, TheCorotatedTangentHoldsWhereTheElementIsInverted) {
  const Mat3 F = Vec3(1.2, 0.9, -0.3).asDiagonal();
  EXPECT_NEAR(energy_density(Law::corotated, liver(), F),
              liver().mu * (0.04 + 0.01 + 1.69) + 0.5 * liver().lambda * 1.2 * 1.2, 1e-12);
  const Mat9 C = stress_derivative(Law::corotated, liver(), F);
  for (int i = 0; i < 9; ++i) {
    Mat3 plus = F, minus = F;
    plus.data()[i] += 1e-6;
    minus.data()[i] -= 1e-6;
    const Mat3 slope =
        (first_piola_stress(Law::corotated, liver(), plus) - first_piola_stress(Law::corotated, liver(), minus)) / 2e-6;
    EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 9, 1>>(slope.data()) - C.col(i)).norm(), 1e-7 * C.norm());
  }
}

TEST(Material, SaintVenantKirchhoffInUniaxialStrainHasItsClosedForm) {
  const Lame lame = liver();
  const double stretch = 1.3, green = 0.5 * (stretch * stretch - 1);
  const Mat3 F = Vec3(stretch, 1, 1).asDiagonal();
  const Mat3 P = first_piola_stress(Law::saint_venant_kirchhoff, lame, F);
  EXPECT_NEAR(P(0, 0), stretch * (lame.lambda + 2 * lame.mu) * green, 1e-12);
  EXPECT_NEAR(P(1, 1), lame.lambda * green, 1e-12);
}

/// Nominal and Cauchy stress along x of a bar that is stretched along x and free to the sides.
struct Bar {
  double lateral_stretch = 1, nominal_MPa = 0, cauchy_MPa = 0, von_mises_MPa = 0;
};

/// Bisection on the lateral stretch, on which the lateral stress of every law rises.
Bar stretched_bar(Law law, const Lame& lame, double stretch) {
  double min = 0.3, max = 1.7;
  Bar bar;
  for (int i = 0; i < 60; ++i) {
    bar.lateral_stretch = 0.5 * (min + max);
    const Mat3 F = Vec3(stretch, bar.lateral_stretch, bar.lateral_stretch).asDiagonal();
    const Mat3 P = first_piola_stress(law, lame, F);
    (P(1, 1) > 0 ? max : min) = bar.lateral_stretch;
    const Mat3 sigma = cauchy_stress(law, lame, F);
    bar.nominal_MPa = P(0, 0);
    bar.cauchy_MPa = sigma(0, 0);
    bar.von_mises_MPa = von_mises(sigma);
  }
  return bar;
}

TEST(Material, AStretchedBarHasTheClosedFormOfItsLaw) {
  const double E = 0.027, nu = 0.45;
  for (double stretch : {0.7, 0.9, 1.1, 1.4}) {
    const double green = 0.5 * (stretch * stretch - 1);
    const Bar svk = stretched_bar(Law::saint_venant_kirchhoff, liver(), stretch);
    EXPECT_NEAR(svk.lateral_stretch, std::sqrt(1 - 2 * nu * green), 1e-12);
    EXPECT_NEAR(svk.nominal_MPa, E * stretch * green, 1e-13);

    for (Law law : {Law::corotated, Law::linear}) {
      const Bar bar = stretched_bar(law, liver(), stretch);
      EXPECT_NEAR(bar.lateral_stretch, 1 - nu * (stretch - 1), 1e-12);
      EXPECT_NEAR(bar.nominal_MPa, E * (stretch - 1), 1e-13);
    }

    // Nearly incompressible rubber: sigma = mu (stretch^2 - 1 / stretch).
    const Lame rubber = lame_of({Law::neo_hookean, 27, 0.49999, ""});
    EXPECT_NEAR(stretched_bar(Law::neo_hookean, rubber, stretch).cauchy_MPa,
                rubber.mu * (stretch * stretch - 1 / stretch), 1e-4 * rubber.mu);

    for (Law law : kLaws) {
      const Bar bar = stretched_bar(law, liver(), stretch);
      EXPECT_NEAR(bar.von_mises_MPa, std::abs(bar.cauchy_MPa), 1e-12) << law_name(law);
    }
  }
}

TEST(Material, SimpleShearHasTheClosedFormOfItsLaw) {
  const Lame lame = liver();
  const double gamma = 0.6;
  Mat3 F = Mat3::Identity();
  F(0, 1) = gamma;
  // E_xy = gamma/2, E_yy = gamma^2/2; P = F S.
  const double trace = 0.5 * gamma * gamma;
  EXPECT_NEAR(first_piola_stress(Law::saint_venant_kirchhoff, lame, F)(0, 1),
              lame.mu * gamma + gamma * (lame.lambda + 2 * lame.mu) * trace, 1e-12);
  const Mat3 rubber = cauchy_stress(Law::neo_hookean, lame, F);
  EXPECT_NEAR(rubber(0, 1), lame.mu * gamma, 1e-12);
  EXPECT_NEAR(rubber(0, 0) - rubber(1, 1), lame.mu * gamma * gamma, 1e-12);
  EXPECT_NEAR(rubber.trace(), 0, 1e-12);
  EXPECT_NEAR(von_mises(rubber), lame.mu * std::sqrt(3 * gamma * gamma + std::pow(gamma, 4)), 1e-12);
  // The stretches of simple shear are sqrt(1 + gamma^2/4) +- gamma/2.
  const double growth = 2 * std::sqrt(1 + gamma * gamma / 4) - 2;
  EXPECT_NEAR(volume_ratio(Law::corotated, F), 1 + growth, 1e-12);
  EXPECT_NEAR(first_piola_stress(Law::linear, lame, F)(0, 1), lame.mu * gamma, 1e-12);
  EXPECT_NEAR(von_mises(cauchy_stress(Law::linear, lame, F)), std::sqrt(3.0) * lame.mu * gamma, 1e-12);
}

TEST(Material, AnEvenSwellingHasPressureAloneAndNoVonMisesStress) {
  const Lame lame = liver();
  const double stretch = 1.2, kappa = bulk_modulus(lame);
  const Mat3 F = stretch * Mat3::Identity();
  const std::pair<Law, double> nominal_pressures[] = {
      {Law::saint_venant_kirchhoff, kappa * 1.5 * stretch * (stretch * stretch - 1)},
      {Law::neo_hookean, kappa * (std::pow(stretch, 3) - 1) * stretch * stretch},
      {Law::corotated, 3 * kappa * (stretch - 1)},
      {Law::linear, 3 * kappa * (stretch - 1)}};
  for (const auto& [law, pressure] : nominal_pressures) {
    EXPECT_LT((first_piola_stress(law, lame, F) - pressure * Mat3::Identity()).norm(), 1e-12) << law_name(law);
    EXPECT_LT(von_mises(cauchy_stress(law, lame, F)), 1e-12) << law_name(law);
  }
}

TEST(Material, TheLawsSayWhereTheyEnd) {
  const auto holds = [](Law law, const Vec3& stretches) {
    return in_valid_range(law, Mat3(Eigen::AngleAxisd(0.03, Vec3::UnitY()) * Mat3(stretches.asDiagonal())));
  };
  EXPECT_TRUE(holds(Law::saint_venant_kirchhoff, {0.58, 1.2, 1.2}));
  EXPECT_FALSE(holds(Law::saint_venant_kirchhoff, {1.2, 0.57, 1.2}));
  EXPECT_TRUE(holds(Law::neo_hookean, {0.2, 2, 2}));
  EXPECT_TRUE(holds(Law::corotated, {0.4, 0.7, 2}));
  EXPECT_FALSE(holds(Law::corotated, {0.4, 2, 0.55}));
  EXPECT_TRUE(holds(Law::linear, {0.96, 1.02, 1.02}));
  EXPECT_FALSE(holds(Law::linear, {0.85, 1.05, 1.05}));
  EXPECT_FALSE(in_valid_range(Law::linear, Mat3(Eigen::AngleAxisd(0.2, Vec3::UnitY()))));
  for (Law law : kLaws) EXPECT_FALSE(holds(law, {1, 1, -1})) << law_name(law);
  // Past the end the stress of Saint Venant-Kirchhoff no longer rises with the compression.
  const auto stress = [](double stretch) {
    return stretched_bar(Law::saint_venant_kirchhoff, liver(), stretch).nominal_MPa;
  };
  EXPECT_LT(stress(0.58), stress(0.60));
  EXPECT_LT(stress(0.575), stress(0.55));
}

TEST(Material, WithItsBarrierThePapersLawStiffensInCompressionAndIsTheSameWhereTheVolumeGrows) {
  const Law plain = Law::saint_venant_kirchhoff, barrier = Law::saint_venant_kirchhoff_barrier;
  for (const double nu : {0.0, 0.3, 0.45, 0.49, 0.499}) {
    const Lame lame = lame_of({barrier, 27, nu, ""});
    EXPECT_EQ(first_piola_stress(barrier, lame, Mat3(Vec3(1.3, 0.95, 0.95).asDiagonal())),
              first_piola_stress(plain, lame, Mat3(Vec3(1.3, 0.95, 0.95).asDiagonal())));
    double confined_before = 0, free_before = 0;
    for (double stretch = 0.99; stretch > 0.05; stretch -= 0.01) {
      const double confined = first_piola_stress(barrier, lame, Mat3(Vec3(stretch, 1, 1).asDiagonal()))(0, 0);
      EXPECT_LT(confined, confined_before) << "nu " << nu << ", confined to " << stretch;
      confined_before = confined;
      if (stretch < 0.2) continue;
      const double to_the_sides_free = stretched_bar(barrier, lame, stretch).nominal_MPa;
      EXPECT_LT(to_the_sides_free, free_before) << "nu " << nu << ", to " << stretch;
      free_before = to_the_sides_free;
    }
    const double slight = first_piola_stress(barrier, lame, Mat3(Vec3(0.95, 1, 1).asDiagonal()))(0, 0) /
                          first_piola_stress(plain, lame, Mat3(Vec3(0.95, 1, 1).asDiagonal()))(0, 0);
    EXPECT_NEAR(slight, 1, 0.01);
  }
}

TEST(Material, VonMisesOfKnownStatesIsTheirClosedForm) {
  EXPECT_NEAR(von_mises(Vec3(-5, 0, 0).asDiagonal()), 5, 1e-12);
  Mat3 shear = Mat3::Zero();
  shear(0, 1) = shear(1, 0) = 2;
  EXPECT_NEAR(von_mises(shear), 2 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(von_mises(7 * Mat3::Identity()), 0, 1e-12);
}

}  // namespace
}  // namespace palpate
