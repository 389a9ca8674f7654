#include "palpate/elastic/material.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace palpate {

namespace {

/// What a law has to answer; the public functions below say what each one means.
struct LawFunctions {
  double (*energy_density)(const Lame&, const Mat3&);
  Mat3 (*first_piola_stress)(const Lame&, const Mat3&);
  Mat9 (*stress_derivative)(const Lame&, const Mat3&);
  double (*volume_ratio)(const Mat3&);
  Mat3 (*volume_ratio_gradient)(const Mat3&);
  Mat9 (*volume_ratio_curvature)(const Mat3&);
  bool (*in_valid_range)(const Mat3&);
};

Eigen::Matrix<double, 9, 1> flat(const Mat3& A) {
  return Eigen::Map<const Eigen::Matrix<double, 9, 1>>(A.data());
}

/// W = lambda/2 tr(E)^2 + mu E:E, theta = 1 + tr(E).
struct SaintVenantKirchhoff {
  /// In uniaxial strain and in uniaxial stress the nominal stress has its extreme at a stretch of 1/sqrt(3) = 0.577.
  static constexpr double kLeastSquaredStretch = 1.0 / 3.0;

  static Mat3 green_strain(const Mat3& F) { return 0.5 * (F.transpose() * F - Mat3::Identity()); }

  static Mat3 second_piola_stress(const Lame& lame, const Mat3& F) {
    const Mat3 E = green_strain(F);
    return lame.lambda * E.trace() * Mat3::Identity() + 2 * lame.mu * E;
  }

  static double energy_density(const Lame& lame, const Mat3& F) {
    const Mat3 E = green_strain(F);
    return 0.5 * lame.lambda * E.trace() * E.trace() + lame.mu * E.squaredNorm();
  }

  static Mat3 first_piola_stress(const Lame& lame, const Mat3& F) { return F * second_piola_stress(lame, F); }

  static Mat9 stress_derivative(const Lame& lame, const Mat3& F) {
    const Mat3 S = second_piola_stress(lame, F), FFt = F * F.transpose();
    Mat9 C;
    for (int l = 0; l < 3; ++l)
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            C(i + 3 * j, k + 3 * l) = (i == k ? S(j, l) : 0) + lame.lambda * F(i, j) * F(k, l) +
                                      lame.mu * (F(i, l) * F(k, j) + (j == l ? FFt(i, k) : 0));
    return C;
  }

  static double volume_ratio(const Mat3& F) { return 0.5 * (F.squaredNorm() - 1); }
  static Mat3 volume_ratio_gradient(const Mat3& F) { return F; }
  static Mat9 volume_ratio_curvature(const Mat3&) { return Mat9::Identity(); }

  /// F^T F less the bound is positive definite exactly where every squared stretch lies above it (Sylvester).
  static bool in_valid_range(const Mat3& F) {
    const Mat3 above = F.transpose() * F - kLeastSquaredStretch * Mat3::Identity();
    return F.determinant() > 0 && above(0, 0) > 0 && above.topLeftCorner<2, 2>().determinant() > 0 &&
           above.determinant() > 0;
  }
};

/// W = mu/2 (J^-2/3 tr(F^T F) - 3) + kappa/2 (J - 1)^2, theta = J.
struct NeoHookean {
  static double energy_density(const Lame& lame, const Mat3& F) {
    const double J = F.determinant();
    if (J <= 0) return std::numeric_limits<double>::infinity();
    return 0.5 * lame.mu * (std::pow(J, -2.0 / 3.0) * F.squaredNorm() - 3) +
           0.5 * bulk_modulus(lame) * (J - 1) * (J - 1);
  }

  static Mat3 first_piola_stress(const Lame& lame, const Mat3& F) {
    const double J = F.determinant();
    const Mat3 G = F.inverse().transpose();
    return lame.mu * std::pow(std::abs(J), -2.0 / 3.0) * (F - F.squaredNorm() / 3.0 * G) +
           bulk_modulus(lame) * (J - 1) * J * G;
  }

  static Mat9 stress_derivative(const Lame& lame, const Mat3& F) {
    const double J = F.determinant();
    const Mat3 G = F.inverse().transpose();
    const double I1 = F.squaredNorm(), kappa = bulk_modulus(lame);
    const double mu_j = lame.mu * std::pow(std::abs(J), -2.0 / 3.0);
    Mat9 C;
    for (int l = 0; l < 3; ++l)
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            C(i + 3 * j, k + 3 * l) =
                mu_j * ((i == k && j == l ? 1 : 0) - 2.0 / 3.0 * (G(k, l) * F(i, j) + F(k, l) * G(i, j)) +
                        2.0 / 9.0 * I1 * G(i, j) * G(k, l) + I1 / 3.0 * G(i, l) * G(k, j)) +
                kappa * ((2 * J - 1) * J * G(i, j) * G(k, l) - (J - 1) * J * G(i, l) * G(k, j));
    return C;
  }

  static double volume_ratio(const Mat3& F) { return F.determinant(); }

  static Mat3 volume_ratio_gradient(const Mat3& F) {
    Mat3 cofactor;
    for (int j = 0; j < 3; ++j) cofactor.col(j) = F.col((j + 1) % 3).cross(F.col((j + 2) % 3));
    return cofactor;
  }

  static Mat9 volume_ratio_curvature(const Mat3& F) {
    // Block (j, l) is the matrix of the cross product with the third column, up to sign.
    Mat9 C = Mat9::Zero();
    for (int j = 0; j < 3; ++j) {
      const int next = (j + 1) % 3, last = (j + 2) % 3;
      Mat3 cross;
      cross << 0, -F(2, last), F(1, last), F(2, last), 0, -F(0, last), -F(1, last), F(0, last), 0;
      C.block<3, 3>(3 * j, 3 * next) = -cross;
      C.block<3, 3>(3 * next, 3 * j) = cross;
    }
    return C;
  }

  /// Polyconvex: as long as nothing is inverted, it keeps its stiffness.
  static bool in_valid_range(const Mat3& F) { return F.determinant() > 0; }
};

/// Of the sum of two stretches, where the derivative of the rotation has its pole.
constexpr double kLeastStretchSum = 1e-6;

/// F = R S with a proper rotation R = U V^T and S = V diag(stretch) V^T; where F is inverted, the last stretch is
/// negative.
struct Polar {
  Mat3 U, V, R;
  Vec3 stretch;

  explicit Polar(const Mat3& F) {
    const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    U = svd.matrixU();
    V = svd.matrixV();
    stretch = svd.singularValues();
    if (U.determinant() * V.determinant() < 0) {
      U.col(2) = -U.col(2);
      stretch[2] = -stretch[2];
    }
    R = U * V.transpose();
  }

  /// dR/dF on column-major vec(F): a turn of F in the plane of two stretches turns R by 2 / (their sum).
  Mat9 rotation_derivative() const {
    Mat9 D = Mat9::Zero();
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const auto turn = flat(U.col(i) * V.col(j).transpose() - U.col(j) * V.col(i).transpose());
      D += turn * turn.transpose() / std::max(stretch[i] + stretch[j], kLeastStretchSum);
    }
    return D;
  }
};

/// W = mu |S - I|^2 + lambda/2 tr(S - I)^2 with F = R S, theta = 1 + tr(S - I).
struct Corotated {
  static double energy_density(const Lame& lame, const Mat3& F) {
    const Vec3 growth = Polar(F).stretch - Vec3::Ones();
    return lame.mu * growth.squaredNorm() + 0.5 * lame.lambda * growth.sum() * growth.sum();
  }

  static Mat3 first_piola_stress(const Lame& lame, const Mat3& F) {
    const Polar polar(F);
    return 2 * lame.mu * (F - polar.R) + lame.lambda * (polar.stretch.sum() - 3) * polar.R;
  }

  static Mat9 stress_derivative(const Lame& lame, const Mat3& F) {
    const Polar polar(F);
    const auto r = flat(polar.R);
    return 2 * lame.mu * Mat9::Identity() + lame.lambda * r * r.transpose() +
           (lame.lambda * (polar.stretch.sum() - 3) - 2 * lame.mu) * polar.rotation_derivative();
  }

  static double volume_ratio(const Mat3& F) { return Polar(F).stretch.sum() - 2; }
  static Mat3 volume_ratio_gradient(const Mat3& F) { return Polar(F).R; }
  static Mat9 volume_ratio_curvature(const Mat3& F) { return Polar(F).rotation_derivative(); }

  /// At kept volume ratio the stiffness against a shear of two principal directions is 2 mu (1 - 1 / (sum of their
  /// stretches)).
  static bool in_valid_range(const Mat3& F) {
    const Vec3 stretch = Polar(F).stretch;
    return stretch[2] > 0 && stretch[1] + stretch[2] > 1;
  }
};

/// W = lambda/2 tr(eps)^2 + mu eps:eps with eps = sym(F) - I, theta = 1 + tr(eps).
struct Linear {
  /// Of |F - I|: first order theory is off by about as much, be it strain or rotation.
  static constexpr double kLargestGradient = 0.1;

  static Mat3 strain(const Mat3& F) { return 0.5 * (F + F.transpose()) - Mat3::Identity(); }

  static double energy_density(const Lame& lame, const Mat3& F) {
    const Mat3 eps = strain(F);
    return 0.5 * lame.lambda * eps.trace() * eps.trace() + lame.mu * eps.squaredNorm();
  }

  static Mat3 first_piola_stress(const Lame& lame, const Mat3& F) {
    const Mat3 eps = strain(F);
    return lame.lambda * eps.trace() * Mat3::Identity() + 2 * lame.mu * eps;
  }

  /// Hooke's tensor: it takes the symmetric part on both sides.
  static Mat9 stress_derivative(const Lame& lame, const Mat3&) {
    Mat9 C = lame.mu * Mat9::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) C(i + 3 * j, j + 3 * i) += lame.mu;
    const auto trace = flat(Mat3::Identity());
    return C + lame.lambda * trace * trace.transpose();
  }

  static double volume_ratio(const Mat3& F) { return F.trace() - 2; }
  static Mat3 volume_ratio_gradient(const Mat3&) { return Mat3::Identity(); }
  static Mat9 volume_ratio_curvature(const Mat3&) { return Mat9::Zero(); }

  static bool in_valid_range(const Mat3& F) { return (F - Mat3::Identity()).norm() <= kLargestGradient; }
};

template <class L>
constexpr LawFunctions kFunctions = {L::energy_density, L::first_piola_stress,    L::stress_derivative,
                                     L::volume_ratio,   L::volume_ratio_gradient, L::volume_ratio_curvature,
                                     L::in_valid_range};

const LawFunctions& functions_of(Law law) {
  switch (law) {
    case Law::saint_venant_kirchhoff:
      return kFunctions<SaintVenantKirchhoff>;
    case Law::neo_hookean:
      return kFunctions<NeoHookean>;
    case Law::corotated:
      return kFunctions<Corotated>;
    case Law::linear:
      return kFunctions<Linear>;
  }
  throw std::invalid_argument("no such law");
}

}  // namespace

double energy_density(Law law, const Lame& lame, const Mat3& F) {
  return functions_of(law).energy_density(lame, F);
}

Mat3 first_piola_stress(Law law, const Lame& lame, const Mat3& F) {
  return functions_of(law).first_piola_stress(lame, F);
}

Mat9 stress_derivative(Law law, const Lame& lame, const Mat3& F) {
  return functions_of(law).stress_derivative(lame, F);
}

double bulk_modulus(const Lame& lame) {
  return lame.lambda + 2.0 / 3.0 * lame.mu;
}

Lame without_bulk(const Lame& lame) {
  return {-2.0 / 3.0 * lame.mu, lame.mu};
}

double volume_ratio(Law law, const Mat3& F) {
  return functions_of(law).volume_ratio(F);
}

Mat3 volume_ratio_gradient(Law law, const Mat3& F) {
  return functions_of(law).volume_ratio_gradient(F);
}

Mat9 volume_ratio_curvature(Law law, const Mat3& F) {
  return functions_of(law).volume_ratio_curvature(F);
}

bool in_valid_range(Law law, const Mat3& F) {
  return functions_of(law).in_valid_range(F);
}

Mat3 cauchy_stress(Law law, const Lame& lame, const Mat3& F) {
  const Mat3 P = first_piola_stress(law, lame, F);
  return law == Law::linear ? P : Mat3(P * F.transpose() / F.determinant());
}

double von_mises(const Mat3& s) {
  const double xy = s(0, 0) - s(1, 1), yz = s(1, 1) - s(2, 2), zx = s(2, 2) - s(0, 0);
  const double shear = s(0, 1) * s(0, 1) + s(1, 2) * s(1, 2) + s(2, 0) * s(2, 0);
  return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx + 6 * shear));
}

}  // namespace palpate
