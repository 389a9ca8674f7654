#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <vector>

#include "palpate/elastic/sparse_factor.h"
#include "palpate/elastic/tet_model.h"

namespace palpate {

struct NewtonStep {
  Eigen::VectorXd du;      ///< on the unknowns, mm
  Eigen::VectorXd lambda;  ///< new multipliers, N
};

/// Eq. 3 by Schur complement on a factored stiffness A = K + rho J^T J of some earlier state, on one fixed pattern:
///   A du + J^T lambda = -f_int + rho J^T g,  J du = g.
/// The same solution as with K, but A is positive definite also where the tissue under the tip softens in compression.
class BorderedSystem {
 public:
  /// `order` of elimination: of a system of the same model with other rows; empty = found anew.
  BorderedSystem(const TetModel& model, const Eigen::SparseMatrix<double>& J, const std::vector<int>& order = {});

  /// Factors the stiffness at `u` (every node). False when even the projected tangent cannot be factored.
  bool factorize(const TetModel& model, const Eigen::VectorXd& u);

  bool usable() const { return usable_; }
  std::vector<int> order() const { return factor_.order(); }
  /// The factor is so old that the steps spent on it have cost more than a new one.
  bool stale() const;
  /// It is half way there.
  bool worn() const;
  /// Adds to these steps.
  void age(int steps);

  /// The multipliers that balance the internal forces (on the unknowns) best.
  Eigen::VectorXd multipliers(const Eigen::VectorXd& f_int) const;
  /// A force that is small for this body: what the largest contact force is compared with where there is none.
  double negligible_force_N() const;
  Eigen::Index constraint_count() const { return J_.rows(); }

  /// Step with the factored state's stiffness.
  NewtonStep solve(const Eigen::VectorXd& f_int, const Eigen::VectorXd& g) const;

  /// Step with the stiffness at `u`: conjugate gradients within J du = g, preconditioned by `solve` (Gould, Hribar,
  /// Nocedal 2001), until the residual has fallen to `fraction`. Where the stiffness is not positive the step ends;
  /// with g = 0 it is still one of descent. Adds what it cost to `solves`.
  NewtonStep solve_at(const TetModel& model, const Eigen::VectorXd& u, const Eigen::VectorXd& f_int,
                      const Eigen::VectorXd& g, double fraction, int& solves);

  /// Unit displacements of footprints, at the state that was factored.
  struct UnitResponse {
    Eigen::MatrixXd du;     ///< of the unknowns, one column per unit displacement
    Eigen::MatrixXd force;  ///< E^T (R K^-1 R^T)^-1 E, N/mm
  };
  /// K du + J^T lambda = 0, J du = E.
  UnitResponse respond(const Eigen::MatrixXd& E) const;
  /// K du + R^T lambda = 0, R du = E for other rows R than J. The factor holds J; the Woodbury identity takes it out.
  UnitResponse respond(const Eigen::SparseMatrix<double>& R, const Eigen::MatrixXd& E) const;

  /// K v at the state of the last `solve_at`.
  Eigen::VectorXd times_stiffness(const Eigen::VectorXd& v) const;

 private:
  Eigen::SparseMatrix<double> J_, K_, JtJ_, A_;
  SparseFactor factor_;
  Eigen::MatrixXd Y_;  // A^-1 J^T
  Eigen::LDLT<Eigen::MatrixXd> schur_, JJt_;
  double rho_ = 0;
  int gradients_ = 0;  // since the last factorisation
  bool usable_ = false;
};

}  // namespace palpate
