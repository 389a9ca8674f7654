#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

namespace palpate {

/// Supernodal Cholesky factorisation of a symmetric matrix with a fixed pattern (CHOLMOD, METIS order).
class SparseFactor {
 public:
  SparseFactor();
  ~SparseFactor();
  SparseFactor(SparseFactor&&) noexcept;
  SparseFactor& operator=(SparseFactor&&) noexcept;

  /// Symbolic analysis of the lower triangle's pattern, in the order of elimination of a similar matrix where one is
  /// given: finding one takes most of the time.
  void analyze(const Eigen::SparseMatrix<double>& lower, const std::vector<int>& order = {});
  /// The order of elimination.
  std::vector<int> order() const;
  /// Numeric factorisation; false when the matrix is not positive definite.
  bool factorize(const Eigen::SparseMatrix<double>& lower);
  /// Floating point operations of one factorisation.
  double operations() const;
  /// Solves for all columns of B.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;
  /// W with W^T W = B^T A^-1 B, by the first half of a solve.
  Eigen::MatrixXd half_solve(const Eigen::MatrixXd& B) const;
  /// Solves in single precision, which halves the memory that has to be read: for iterations that correct themselves.
  Eigen::VectorXd solve_roughly(const Eigen::VectorXd& b) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
