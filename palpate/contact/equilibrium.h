#pragma once

#include "palpate/contact/footprint.h"
#include "palpate/elastic/sparse_factor.h"
#include "palpate/elastic/tet_model.h"

namespace palpate {

struct EquilibriumOptions {
  double relative_residual = 1e-6;  ///< of the largest nodal force
  int max_iterations = 60;          ///< Newton steps of one call, all parts of the displacement together
  /// Bound on the time of one call, counted in solves with the factor (a new factor counts as 40), for each longest
  /// step of displacement.
  int max_solves = 400;
  double longest_step_mm = 2.0;  ///< prescribed displacement applied at once
};

/// What one of the contacts does to the tissue.
struct ContactForce {
  Vec3 force_N = Vec3::Zero();    ///< of the instrument on the tissue: sum of -J^T lambda over its rows
  double mean_nodal_force_N = 0;  ///< F_f of the paper: mean magnitude of the nodal forces around the contact
};

/// Answer of Eq. 3, with everything needed to judge it.
struct Equilibrium {
  bool converged = false;
  double residual = 0;  ///< largest unbalanced nodal force over the largest contact force
  int iterations = 0;
  double smallest_volume_ratio = 1;
  Eigen::VectorXd u;                   ///< displacement of every node, mm (3 n)
  Eigen::VectorXd lambda;              ///< multipliers, 3 per sample of each contact in turn, N
  std::vector<ContactForce> contacts;  ///< in the order in which they were held
  Vec3 force_N = Vec3::Zero();         ///< of the first of them
  double mean_nodal_force_N = 0;       ///< of the first of them
};

/// The force for a tip near a solved state, at any rate: F(p) = force + stiffness (p - displacement).
struct ContactStiffness {
  Vec3 displacement_mm = Vec3::Zero();
  Vec3 force_N = Vec3::Zero();             ///< of the instrument on the tissue
  Mat3 stiffness_N_per_mm = Mat3::Zero();  ///< dF/dp, symmetric

  Vec3 force_at(const Vec3& p_mm) const { return force_N + stiffness_N_per_mm * (p_mm - displacement_mm); }
};

/// How the answer changes with what is known badly, to first order: the columns are x, y, z of contact 0, of contact
/// 1, ...
struct ContactSensitivity {
  Eigen::MatrixXd motion;  ///< du/dp of every node (3 n rows)
  Eigen::MatrixXd force;   ///< dF/dp, N/mm: three rows for each contact
};

/// Keeps the factor and the last state of one body with the footprints that are held; solves for the displacements p of
/// the footprints.
class EquilibriumSolver {
 public:
  explicit EquilibriumSolver(const TetModel& model, const EquilibriumOptions& options = {});
  ~EquilibriumSolver();
  EquilibriumSolver(EquilibriumSolver&&) noexcept;

  /// Begins a contact from rest (u = 0), the only one.
  void hold(const Footprint& footprint);
  /// Begins one more contact on the tissue as it is now: its displacement counts from here.
  void hold_also(const Footprint& footprint);
  /// Ends contact `number`, counted from 0 in the order in which they were held; those after it move up.
  void release(size_t number);
  /// Ends all of them.
  void release();
  /// Other footprints for the contacts that are held, in their order. The tissue stays as it is; displacements count
  /// from rest.
  void replace(const std::vector<Footprint>& footprints);

  /// Newton on Eq. 3 from the last state: K u + J^T lambda = f, J u = p with the same p for every sample of a contact.
  /// The factor of an earlier state serves as long as it makes the residual fall quickly, then as the preconditioner of
  /// conjugate gradients. An answer that ran out of `most_solves` is where the next call goes on. One displacement per
  /// contact.
  Equilibrium solve_all(const std::vector<Vec3>& displacements_mm);
  Equilibrium solve(const Vec3& displacement_mm) { return solve_all({displacement_mm}); }

  /// The stiffness of the first contact at the state of the last answer, the others held where they are:
  /// (J K^-1 J^T)^-1 condensed on one displacement of all its samples, by three solves.
  ContactStiffness contact_stiffness();

  /// Factors the stiffness of the last answer where the factor at hand would not serve for long.
  void refresh();

  /// At the state in which the stiffness was factored last, without a further factorization.
  ContactSensitivity sensitivity() const;
  /// The same if the contacts had these footprints instead, one for each.
  ContactSensitivity sensitivity_with(const std::vector<Footprint>& footprints) const;
  /// How often the stiffness was factored so far: what `sensitivity` hangs on.
  int factorizations() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
