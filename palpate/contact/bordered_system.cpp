#include "palpate/contact/bordered_system.h"

#include <Eigen/LU>

#include <algorithm>

namespace palpate {

namespace {

/// Conjugate gradients end after so many steps.
constexpr int kMaxGradients = 40;
/// Steps on one factor that have cost more than a new one.
constexpr int kStaleGradients = 80;
/// What a new tangent costs, in solves.
constexpr int kTangentCost = 4;
/// rho over the mean diagonal of K at rest. With 1, A is indefinite in equilibria of a deep push whose K is positive
/// definite along the constraint, and Newton falls back to the slow projected tangent there; from 10 on it is not.
constexpr double kConstraintWeight = 100;
/// The force of a contact at rest is zero: its residual is weighed against the force that moves a node this far, times
/// the mean diagonal of K.
constexpr double kNegligible_mm = 1e-4;

}  // namespace

BorderedSystem::BorderedSystem(const TetModel& model, const Eigen::SparseMatrix<double>& J,
                               const std::vector<int>& order)
    : J_(J) {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * model.node_count());
  model.tangent(rest, false, K_);
  rho_ = kConstraintWeight * K_.diagonal().mean();
  const Eigen::SparseMatrix<double> full = rho_ * (J.transpose() * J);
  JtJ_ = full.triangularView<Eigen::Lower>();
  A_ = K_ + JtJ_;
  factor_.analyze(A_, order);
  JJt_.compute(Eigen::MatrixXd(J * J.transpose()));
}

bool BorderedSystem::factorize(const TetModel& model, const Eigen::VectorXd& u) {
  usable_ = false;
  gradients_ = 0;
  for (bool project : {false, true}) {
    model.tangent(u, project, K_);
    A_ = K_ + JtJ_;
    if (!factor_.factorize(A_)) continue;
    Y_ = factor_.solve(Eigen::MatrixXd(J_.transpose()));
    schur_.compute(J_ * Y_);
    usable_ = schur_.info() == Eigen::Success;
    return usable_;
  }
  return false;
}

bool BorderedSystem::stale() const {
  return gradients_ > kStaleGradients;
}

bool BorderedSystem::worn() const {
  return gradients_ > kStaleGradients / 2;
}

void BorderedSystem::age(int steps) {
  gradients_ += std::max(0, steps);
}

Eigen::VectorXd BorderedSystem::multipliers(const Eigen::VectorXd& f_int) const {
  return -JJt_.solve(J_ * f_int);
}

double BorderedSystem::negligible_force_N() const {
  return kNegligible_mm * rho_ / kConstraintWeight;
}

NewtonStep BorderedSystem::solve(const Eigen::VectorXd& f_int, const Eigen::VectorXd& g) const {
  const Eigen::VectorXd a = factor_.solve_roughly(-f_int + rho_ * (J_.transpose() * g));
  NewtonStep step;
  step.lambda = schur_.solve(J_ * a - g);
  step.du = a - Y_ * step.lambda;
  step.du += J_.transpose() * JJt_.solve(g - J_ * step.du);
  return step;
}

NewtonStep BorderedSystem::solve_at(const TetModel& model, const Eigen::VectorXd& u, const Eigen::VectorXd& f_int,
                                    const Eigen::VectorXd& g, double fraction, int& solves) {
  model.tangent(u, false, K_);
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(J_.rows());
  const bool constrained = g.isZero(0);
  Eigen::VectorXd residual = f_int, du = Eigen::VectorXd::Zero(f_int.size());
  if (!constrained) {
    du = solve(f_int, g).du;
    residual += K_.selfadjointView<Eigen::Lower>() * du;
  }
  NewtonStep step = solve(residual, still);
  Eigen::VectorXd along = step.du;
  step.du = du;
  double slope = -residual.dot(along);
  const double enough = fraction * fraction * slope;
  int gradients = constrained ? 1 : 2;
  for (; gradients < kMaxGradients && slope > enough; ++gradients) {
    const Eigen::VectorXd K_along = K_.selfadjointView<Eigen::Lower>() * along;
    const double curvature = along.dot(K_along);
    if (curvature <= 0) {
      if (gradients == 1) step.du = along;
      break;
    }
    const double length = slope / curvature;
    step.du += length * along;
    residual += length * K_along;
    const NewtonStep correction = solve(residual, still);
    step.lambda = correction.lambda;
    const double last_slope = slope;
    slope = -residual.dot(correction.du);
    along = correction.du + slope / last_slope * along;
  }
  gradients_ += gradients;
  solves += gradients + kTangentCost;
  return step;
}

BorderedSystem::UnitResponse BorderedSystem::respond(const Eigen::MatrixXd& E) const {
  const Eigen::MatrixXd on_J = schur_.solve(E);
  return {Y_ * on_J, E.transpose() * (on_J - rho_ * E)};
}

BorderedSystem::UnitResponse BorderedSystem::respond(const Eigen::SparseMatrix<double>& R,
                                                     const Eigen::MatrixXd& E) const {
  // K^-1 = A^-1 + Y (1/rho - S)^-1 Y^T with A = K + rho J^T J, Y = A^-1 J^T, S = J Y.
  const Eigen::MatrixXd S = J_ * Y_, RY = R * Y_;
  const Eigen::PartialPivLU<Eigen::MatrixXd> without_J(Eigen::MatrixXd::Identity(S.rows(), S.cols()) / rho_ - S);
  const Eigen::MatrixXd W = factor_.half_solve(Eigen::MatrixXd(R.transpose()));
  const Eigen::MatrixXd compliance = W.transpose() * W + RY * without_J.solve(RY.transpose());
  const Eigen::MatrixXd multipliers = compliance.partialPivLu().solve(E);
  const Eigen::MatrixXd du =
      factor_.solve(R.transpose() * multipliers) + Y_ * without_J.solve(RY.transpose() * multipliers);
  return {du, E.transpose() * multipliers};
}

Eigen::VectorXd BorderedSystem::times_stiffness(const Eigen::VectorXd& v) const {
  return K_.selfadjointView<Eigen::Lower>() * v;
}

}  // namespace palpate
