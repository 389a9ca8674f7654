#include "palpate/infer/map_estimate.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

namespace palpate {

namespace {

constexpr int kReweightings = 4;

/// A measurement whitened: covariance = L L^T, residual and H multiplied by L^-1.
struct Whitened {
  decltype(Measurement::residual) residual;
  decltype(Measurement::H) H;
  double log_determinant = 0;
};

Whitened whiten(const Measurement& m) {
  const Eigen::LLT<decltype(Measurement::covariance)> llt(m.covariance);
  Whitened w{m.residual, m.H, 2 * llt.matrixLLT().diagonal().array().log().sum()};
  llt.matrixL().solveInPlace(w.residual);
  llt.matrixL().solveInPlace(w.H);
  return w;
}

double log_determinant(const Eigen::LLT<Eigen::MatrixXd>& llt) {
  return 2 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

double log_student_t(double distance2, double log_determinant, double size, double dof) {
  return std::lgamma(0.5 * (dof + size)) - std::lgamma(0.5 * dof) -
         0.5 * (size * std::log(dof * std::numbers::pi) + log_determinant) -
         0.5 * (dof + size) * std::log1p(distance2 / dof);
}

MapEstimate maximum_a_posteriori(const Belief& prior, const Eigen::VectorXd& x0,
                                 const std::vector<Measurement>& measurements) {
  std::vector<Whitened> whitened;
  whitened.reserve(measurements.size());
  for (const Measurement& m : measurements) whitened.push_back(whiten(m));
  const Eigen::Index n = prior.mean.size();
  const Eigen::LLT<Eigen::MatrixXd> prior_llt(prior.covariance);
  const Eigen::MatrixXd prior_information = prior_llt.solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd towards_prior = prior_information * (prior.mean - x0);

  Eigen::VectorXd dx = Eigen::VectorXd::Zero(n);
  Eigen::LLT<Eigen::MatrixXd> information_llt;
  for (int iteration = 0; iteration < kReweightings; ++iteration) {
    Eigen::MatrixXd information = prior_information;
    Eigen::VectorXd right = towards_prior;
    for (size_t i = 0; i < whitened.size(); ++i) {
      const Whitened& w = whitened[i];
      const auto size = static_cast<double>(w.residual.size());
      const double distance2 = (w.residual - w.H * dx).squaredNorm(), dof = measurements[i].dof;
      const double weight = measurements[i].weight * (dof + size) / (dof + distance2);
      information.noalias() += weight * w.H.transpose() * w.H;
      right.noalias() += weight * w.H.transpose() * w.residual;
    }
    information_llt.compute(information);
    dx = information_llt.solve(right);
  }

  MapEstimate estimate;
  estimate.posterior.mean = x0 + dx;
  estimate.posterior.covariance = information_llt.solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd from_prior = estimate.posterior.mean - prior.mean;
  estimate.log_evidence = -0.5 * (from_prior.dot(prior_information * from_prior) + log_determinant(prior_llt) +
                                  log_determinant(information_llt));
  for (size_t i = 0; i < whitened.size(); ++i) {
    const Whitened& w = whitened[i];
    const auto size = static_cast<double>(w.residual.size());
    const double distance2 = (w.residual - w.H * dx).squaredNorm(), dof = measurements[i].dof,
                 weight = measurements[i].weight;
    estimate.log_evidence += weight * log_student_t(distance2, w.log_determinant, size, dof);
    estimate.chi2 += weight * distance2 * (dof + size) / (dof + distance2);
    estimate.dof += weight * size;
  }
  return estimate;
}

}  // namespace palpate
