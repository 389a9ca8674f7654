#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "palpate/elastic/material.h"
#include "palpate/elastic/simd.h"

/// The laws of material.h, each formula written once for a number and for eight elements at once.
namespace palpate::laws {

template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;
template <class T>
using Matrix9 = Eigen::Matrix<T, 9, 9>;

template <class T>
Eigen::Matrix<T, 9, 1> flat(const Matrix3<T>& A) {
  return Eigen::Map<const Eigen::Matrix<T, 9, 1>>(A.data());
}

/// f of each lane's own matrix: for laws that need a decomposition.
template <class Result, class Function>
Result lane_by_lane(const Matrix3<Simd>& F, Function f) {
  Result result;
  for (int lane = 0; lane < Simd::kCount; ++lane) {
    const auto of_lane = f(Mat3(F.unaryExpr([lane](const Simd& x) { return x[lane]; })));
    for (int k = 0; k < result.size(); ++k) result.data()[k].set(lane, of_lane.data()[k]);
  }
  return result;
}

/// W = lambda/2 tr(E)^2 + mu E:E, theta = 1 + tr(E).
struct SaintVenantKirchhoff {
  /// In uniaxial strain and in uniaxial stress the nominal stress has its extreme at a stretch of 1/sqrt(3) = 0.577.
  static constexpr double kMinSquaredStretch = 1.0 / 3.0;

  template <class T>
  static Matrix3<T> green_strain(const Matrix3<T>& F) {
    return 0.5 * (F.transpose() * F - Matrix3<T>::Identity());
  }

  template <class T>
  static Matrix3<T> second_piola_stress(const Lame& lame, const Matrix3<T>& F) {
    const Matrix3<T> E = green_strain(F);
    return lame.lambda * E.trace() * Matrix3<T>::Identity() + 2 * lame.mu * E;
  }

  template <class T>
  static T energy_density(const Lame& lame, const Matrix3<T>& F) {
    const Matrix3<T> E = green_strain(F);
    return 0.5 * lame.lambda * E.trace() * E.trace() + lame.mu * E.squaredNorm();
  }

  template <class T>
  static Matrix3<T> first_piola_stress(const Lame& lame, const Matrix3<T>& F) {
    return F * second_piola_stress(lame, F);
  }

  template <class T>
  static Matrix9<T> stress_derivative(const Lame& lame, const Matrix3<T>& F) {
    const Matrix3<T> S = second_piola_stress(lame, F), FFt = F * F.transpose();
    Matrix9<T> C;
    for (int l = 0; l < 3; ++l)
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            C(i + 3 * j, k + 3 * l) = (i == k ? S(j, l) : T(0)) + lame.lambda * F(i, j) * F(k, l) +
                                      lame.mu * (F(i, l) * F(k, j) + (j == l ? FFt(i, k) : T(0)));
    return C;
  }

  template <class T>
  static T volume_ratio(const Matrix3<T>& F) {
    return 0.5 * (F.squaredNorm() - 1);
  }
  template <class T>
  static Matrix3<T> volume_ratio_gradient(const Matrix3<T>& F) {
    return F;
  }
  template <class T>
  static Matrix9<T> volume_ratio_curvature(const Matrix3<T>&) {
    return Matrix9<T>::Identity();
  }

  /// F^T F less the bound is positive definite exactly where every squared stretch lies above it (Sylvester).
  static bool in_valid_range(const Mat3& F) {
    const Mat3 above = F.transpose() * F - kMinSquaredStretch * Mat3::Identity();
    return F.determinant() > 0 && above(0, 0) > 0 && above.topLeftCorner<2, 2>().determinant() > 0 &&
           above.determinant() > 0;
  }
};

/// Saint Venant-Kirchhoff with beta b(J), b = -(J - 1)^2 ln J where J < 1 (the barrier of Li et al. 2020): the same law
/// where J >= 1 and, to second order, at rest; infinite where an element would be flat. Its range is that of the plain
/// law: no barrier on J gives back the shear stiffness that pressure takes away in lambda/2 tr(E)^2.
struct SaintVenantKirchhoffBarrier : SaintVenantKirchhoff {
  static double barrier(double J) {
    if (J >= 1) return 0;
    return J > 0 ? -(J - 1) * (J - 1) * std::log(J) : std::numeric_limits<double>::infinity();
  }
  static double slope(double J) { return J >= 1 || J <= 0 ? 0 : -2 * (J - 1) * std::log(J) - (J - 1) * (J - 1) / J; }
  static double curvature(double J) {
    return J >= 1 || J <= 0 ? 0 : -2 * std::log(J) - 4 * (J - 1) / J + (J - 1) * (J - 1) / (J * J);
  }

  template <class T>
  static T energy_density(const Lame& lame, const Matrix3<T>& F) {
    return SaintVenantKirchhoff::energy_density(lame, F) + lame.barrier * each(T(F.determinant()), barrier);
  }

  template <class T>
  static Matrix3<T> first_piola_stress(const Lame& lame, const Matrix3<T>& F) {
    const T J = F.determinant();
    const T pull = lame.barrier * each(J, slope) * J;
    return SaintVenantKirchhoff::first_piola_stress(lame, F) + pull * Matrix3<T>(F.inverse().transpose());
  }

  template <class T>
  static Matrix9<T> stress_derivative(const Lame& lame, const Matrix3<T>& F) {
    const T J = F.determinant();
    const Matrix3<T> G = F.inverse().transpose();
    const T first = lame.barrier * each(J, slope) * J, second = lame.barrier * each(J, curvature) * J * J;
    Matrix9<T> C = SaintVenantKirchhoff::stress_derivative(lame, F);
    for (int l = 0; l < 3; ++l)
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            C(i + 3 * j, k + 3 * l) += (second + first) * G(i, j) * G(k, l) - first * G(i, l) * G(k, j);
    return C;
  }
};

/// W = mu/2 (J^-2/3 tr(F^T F) - 3) + kappa/2 (J - 1)^2, theta = J.
struct NeoHookean {
  /// J^-2/3, which takes the change of volume out of F^T F.
  static double isochoric_scale(double J) { return std::pow(std::abs(J), -2.0 / 3.0); }

  /// Infinite where the element is inverted.
  template <class T>
  static T energy_density(const Lame& lame, const Matrix3<T>& F) {
    const T J = F.determinant();
    const T scale =
        each(J, [](double j) { return j > 0 ? isochoric_scale(j) : std::numeric_limits<double>::infinity(); });
    return 0.5 * lame.mu * (scale * F.squaredNorm() - 3) + 0.5 * bulk_modulus(lame) * (J - 1) * (J - 1);
  }

  template <class T>
  static Matrix3<T> first_piola_stress(const Lame& lame, const Matrix3<T>& F) {
    const T J = F.determinant();
    const Matrix3<T> G = F.inverse().transpose();
    return lame.mu * each(J, isochoric_scale) * (F - F.squaredNorm() / 3.0 * G) + bulk_modulus(lame) * (J - 1) * J * G;
  }

  template <class T>
  static Matrix9<T> stress_derivative(const Lame& lame, const Matrix3<T>& F) {
    const T J = F.determinant();
    const Matrix3<T> G = F.inverse().transpose();
    const T I1 = F.squaredNorm();
    const double kappa = bulk_modulus(lame);
    const T mu_j = lame.mu * each(J, isochoric_scale);
    Matrix9<T> C;
    for (int l = 0; l < 3; ++l)
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            C(i + 3 * j, k + 3 * l) =
                mu_j * (T(i == k && j == l ? 1 : 0) - 2.0 / 3.0 * (G(k, l) * F(i, j) + F(k, l) * G(i, j)) +
                        2.0 / 9.0 * I1 * G(i, j) * G(k, l) + I1 / 3.0 * G(i, l) * G(k, j)) +
                kappa * ((2 * J - 1) * J * G(i, j) * G(k, l) - (J - 1) * J * G(i, l) * G(k, j));
    return C;
  }

  template <class T>
  static T volume_ratio(const Matrix3<T>& F) {
    return F.determinant();
  }

  template <class T>
  static Matrix3<T> volume_ratio_gradient(const Matrix3<T>& F) {
    Matrix3<T> cofactor;
    for (int j = 0; j < 3; ++j) cofactor.col(j) = F.col((j + 1) % 3).cross(F.col((j + 2) % 3));
    return cofactor;
  }

  template <class T>
  static Matrix9<T> volume_ratio_curvature(const Matrix3<T>& F) {
    // Block (j, l) is the matrix of the cross product with the third column, up to sign.
    Matrix9<T> C = Matrix9<T>::Zero();
    for (int j = 0; j < 3; ++j) {
      const int next = (j + 1) % 3, last = (j + 2) % 3;
      Matrix3<T> cross;
      cross << 0, -F(2, last), F(1, last), F(2, last), 0, -F(0, last), -F(1, last), F(0, last), 0;
      C.template block<3, 3>(3 * j, 3 * next) = -cross;
      C.template block<3, 3>(3 * next, 3 * j) = cross;
    }
    return C;
  }

  /// Polyconvex: as long as nothing is inverted, it keeps its stiffness.
  static bool in_valid_range(const Mat3& F) { return F.determinant() > 0; }
};

/// Of the sum of two stretches, where the derivative of the rotation has its pole.
constexpr double kMinStretchSum = 1e-6;

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
      const auto turn = flat<double>(U.col(i) * V.col(j).transpose() - U.col(j) * V.col(i).transpose());
      D += turn * turn.transpose() / std::max(stretch[i] + stretch[j], kMinStretchSum);
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

  static Simd energy_density(const Lame& lame, const Matrix3<Simd>& F) {
    return lane_by_lane<Eigen::Matrix<Simd, 1, 1>>(
        F, [&lame](const Mat3& one) { return Eigen::Matrix<double, 1, 1>(energy_density(lame, one)); })(0);
  }
  static Matrix3<Simd> first_piola_stress(const Lame& lame, const Matrix3<Simd>& F) {
    return lane_by_lane<Matrix3<Simd>>(F, [&lame](const Mat3& one) { return first_piola_stress(lame, one); });
  }
  static Matrix9<Simd> stress_derivative(const Lame& lame, const Matrix3<Simd>& F) {
    return lane_by_lane<Matrix9<Simd>>(F, [&lame](const Mat3& one) { return stress_derivative(lame, one); });
  }
  static Simd volume_ratio(const Matrix3<Simd>& F) {
    return lane_by_lane<Eigen::Matrix<Simd, 1, 1>>(
        F, [](const Mat3& one) { return Eigen::Matrix<double, 1, 1>(volume_ratio(one)); })(0);
  }
  static Matrix3<Simd> volume_ratio_gradient(const Matrix3<Simd>& F) {
    return lane_by_lane<Matrix3<Simd>>(F, [](const Mat3& one) { return volume_ratio_gradient(one); });
  }
  static Matrix9<Simd> volume_ratio_curvature(const Matrix3<Simd>& F) {
    return lane_by_lane<Matrix9<Simd>>(F, [](const Mat3& one) { return volume_ratio_curvature(one); });
  }

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

  template <class T>
  static Matrix3<T> strain(const Matrix3<T>& F) {
    return 0.5 * (F + F.transpose()) - Matrix3<T>::Identity();
  }

  template <class T>
  static T energy_density(const Lame& lame, const Matrix3<T>& F) {
    const Matrix3<T> eps = strain(F);
    return 0.5 * lame.lambda * eps.trace() * eps.trace() + lame.mu * eps.squaredNorm();
  }

  template <class T>
  static Matrix3<T> first_piola_stress(const Lame& lame, const Matrix3<T>& F) {
    const Matrix3<T> eps = strain(F);
    return lame.lambda * eps.trace() * Matrix3<T>::Identity() + 2 * lame.mu * eps;
  }

  /// Hooke's tensor: it takes the symmetric part on both sides.
  template <class T>
  static Matrix9<T> stress_derivative(const Lame& lame, const Matrix3<T>&) {
    Matrix9<T> C = T(lame.mu) * Matrix9<T>::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) C(i + 3 * j, j + 3 * i) += lame.mu;
    const auto trace = flat<T>(Matrix3<T>::Identity());
    return C + lame.lambda * trace * trace.transpose();
  }

  template <class T>
  static T volume_ratio(const Matrix3<T>& F) {
    return F.trace() - 2;
  }
  template <class T>
  static Matrix3<T> volume_ratio_gradient(const Matrix3<T>&) {
    return Matrix3<T>::Identity();
  }
  template <class T>
  static Matrix9<T> volume_ratio_curvature(const Matrix3<T>&) {
    return Matrix9<T>::Zero();
  }

  static bool in_valid_range(const Mat3& F) { return (F - Mat3::Identity()).norm() <= kLargestGradient; }
};

/// f(law) with the law as one of the types above.
template <class Function>
auto with_law(Law law, Function f) {
  switch (law) {
    case Law::saint_venant_kirchhoff:
      return f(SaintVenantKirchhoff());
    case Law::saint_venant_kirchhoff_barrier:
      return f(SaintVenantKirchhoffBarrier());
    case Law::neo_hookean:
      return f(NeoHookean());
    case Law::corotated:
      return f(Corotated());
    case Law::linear:
      return f(Linear());
  }
  throw std::invalid_argument("no such law");
}

}  // namespace palpate::laws
