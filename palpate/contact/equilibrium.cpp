#include "palpate/contact/equilibrium.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace palpate {

namespace {

constexpr int kMostHalvings = 12;
constexpr int kMostSubdivisions = 5;
/// A step that leaves more than this share of the residual calls for a new factorisation.
constexpr double kSlowShare = 0.4;
/// rho over the mean diagonal of K at rest. With 1, A is indefinite in equilibria of a deep push whose K is positive
/// definite along the constraint, and Newton falls back to the slow projected tangent there; from 10 on it is not.
constexpr double kConstraintWeight = 100;

struct NewtonStep {
  Eigen::VectorXd du;      // on the unknowns
  Eigen::VectorXd lambda;  // new multipliers
};

/// Eq. 3 by Schur complement on the factored stiffness A = K + rho J^T J, on one fixed pattern:
///   A du + J^T lambda = -f_int + rho J^T g,  J du = g.
/// The same solution as with K, but A is positive definite also where the tissue under the tip softens in compression.
class BorderedSystem {
 public:
  BorderedSystem(const TetModel& model, const Eigen::SparseMatrix<double>& J) : J_(J) {
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * model.node_count());
    model.tangent(rest, false, K_);
    rho_ = kConstraintWeight * K_.diagonal().mean();
    const Eigen::SparseMatrix<double> full = rho_ * (J.transpose() * J);
    JtJ_ = full.triangularView<Eigen::Lower>();
    A_ = K_ + JtJ_;
    factor_.analyze(A_);
  }

  /// False when even the projected tangent cannot be factored.
  bool factorize(const TetModel& model, const Eigen::VectorXd& u) {
    usable_ = false;
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

  bool usable() const { return usable_; }
  double rho() const { return rho_; }

  std::optional<NewtonStep> solve(const Eigen::VectorXd& f_int, const Eigen::VectorXd& g) const {
    const Eigen::VectorXd a = factor_.solve(Eigen::VectorXd(-f_int + rho_ * (J_.transpose() * g)));
    NewtonStep step;
    step.lambda = schur_.solve(J_ * a - g);
    step.du = a - Y_ * step.lambda;
    if (!step.du.allFinite() || !step.lambda.allFinite()) return std::nullopt;
    return step;
  }

 private:
  Eigen::SparseMatrix<double> J_, K_, JtJ_, A_;
  SparseFactor factor_;
  Eigen::MatrixXd Y_;  // A^-1 J^T
  Eigen::LDLT<Eigen::MatrixXd> schur_;
  double rho_ = 0;
  bool usable_ = false;
};

double largest_nodal_norm(const Eigen::VectorXd& v) {
  double largest = 0;
  for (Eigen::Index i = 0; i + 2 < v.size(); i += 3) largest = std::max(largest, v.segment<3>(i).norm());
  return largest;
}

}  // namespace

struct EquilibriumSolver::State {
  const TetModel& model;
  EquilibriumOptions options;
  Footprint footprint;
  Eigen::SparseMatrix<double> J;
  std::unique_ptr<BorderedSystem> system;
  Eigen::VectorXd u;       // unknowns of the last equilibrium
  Eigen::VectorXd lambda;  // its multipliers
  Vec3 displacement_mm = Vec3::Zero();
  int iterations_left = 0;

  struct Reached {
    bool converged = false;
    double residual = 0;
  };

  State(const TetModel& m, const EquilibriumOptions& o) : model(m), options(o) {}

  double energy(const Eigen::VectorXd& reduced) const { return model.energy(model.expand(reduced)); }

  /// Newton towards J u = p for one step of the displacement; on failure the state is left as it was.
  Reached newton(const Vec3& p) {
    const Eigen::VectorXd target = p.replicate(J.rows() / 3, 1);
    Eigen::VectorXd trial = u, multipliers = lambda;
    Reached reached;
    // The factor of an earlier state serves as long as it makes the true residual fall quickly.
    bool fresh = false, refactor = !system->usable();
    double last_residual = std::numeric_limits<double>::infinity();
    for (;;) {
      const Eigen::VectorXd full = model.expand(trial);
      const Eigen::VectorXd f_int = model.reduce(model.internal_force(full));
      const Eigen::VectorXd g = target - J * trial;
      const Eigen::VectorXd contact = J.transpose() * multipliers;
      const double scale = std::max(largest_nodal_norm(contact), 1e-9 * system->rho());
      reached.residual = largest_nodal_norm(f_int + contact) / scale;
      const bool constrained = g.size() == 0 || g.lpNorm<Eigen::Infinity>() < 1e-9;
      if (constrained && reached.residual <= options.relative_residual) {
        reached.converged = true;
        u = trial;
        lambda = multipliers;
        displacement_mm = p;
        return reached;
      }
      if (iterations_left == 0) return reached;
      --iterations_left;
      if (constrained && reached.residual > kSlowShare * last_residual) refactor = true;
      if (constrained) last_residual = reached.residual;
      if (refactor) {
        if (!system->factorize(model, full)) return reached;
        fresh = true;
        refactor = false;
      } else {
        fresh = false;
      }
      const auto step = system->solve(f_int, g);
      const auto length = step ? step_length(trial, step->du, f_int, constrained) : std::nullopt;
      if (!length) {
        if (fresh) return reached;
        refactor = true;
        continue;
      }
      trial += *length * step->du;
      multipliers += *length * (step->lambda - multipliers);
    }
  }

  /// Full steps move the constraint; afterwards the energy has to fall (Armijo).
  std::optional<double> step_length(const Eigen::VectorXd& from, const Eigen::VectorXd& du,
                                    const Eigen::VectorXd& f_int, bool constrained) const {
    if (!constrained) return std::isfinite(energy(from + du)) ? std::optional<double>(1.0) : std::nullopt;
    const double before = energy(from), slope = f_int.dot(du);
    // Near the solution energies differ by rounding only.
    const double rounding = 1e-12 * std::abs(before) + 1e-18;
    double length = 1;
    for (int halving = 0; halving < kMostHalvings; ++halving, length *= 0.5)
      if (energy(from + length * du) <= before + 1e-4 * length * std::min(slope, 0.0) + rounding) return length;
    return std::nullopt;
  }

  Reached move_to(const Vec3& p, int depth) {
    Reached reached = newton(p);
    if (reached.converged || depth >= kMostSubdivisions || iterations_left == 0) return reached;
    const Reached half = move_to(0.5 * (displacement_mm + p), depth + 1);
    return half.converged ? move_to(p, depth + 1) : half;
  }

  Equilibrium answer(const Reached& reached) const {
    Equilibrium result;
    result.converged = reached.converged;
    result.residual = reached.residual;
    result.iterations = options.most_iterations - iterations_left;
    result.u = model.expand(u);
    result.lambda = lambda;
    result.smallest_volume_ratio = model.smallest_volume_ratio(result.u);
    const Eigen::VectorXd on_tissue = -(J.transpose() * lambda);
    double sum_of_norms = 0;
    int loaded_nodes = 0;
    for (Eigen::Index i = 0; i + 2 < on_tissue.size(); i += 3) {
      const Vec3 force = on_tissue.segment<3>(i);
      result.force_N += force;
      if (force.squaredNorm() == 0) continue;
      sum_of_norms += force.norm();
      ++loaded_nodes;
    }
    if (loaded_nodes > 0) result.mean_nodal_force_N = sum_of_norms / loaded_nodes;
    return result;
  }
};

EquilibriumSolver::EquilibriumSolver(const TetModel& model, const EquilibriumOptions& options)
    : state_(std::make_unique<State>(model, options)) {}
EquilibriumSolver::~EquilibriumSolver() = default;
EquilibriumSolver::EquilibriumSolver(EquilibriumSolver&&) noexcept = default;

void EquilibriumSolver::hold(const Footprint& footprint) {
  State& s = *state_;
  s.footprint = footprint;
  s.J = constraint_matrix(s.model, footprint);
  s.system = std::make_unique<BorderedSystem>(s.model, s.J);
  s.u = Eigen::VectorXd::Zero(s.model.unknown_count());
  s.lambda = Eigen::VectorXd::Zero(s.J.rows());
  s.displacement_mm.setZero();
}

void EquilibriumSolver::release() {
  state_->system.reset();
}

Equilibrium EquilibriumSolver::solve(const Vec3& displacement_mm) {
  State& s = *state_;
  if (!s.system) {
    Equilibrium rest;
    rest.converged = true;
    rest.u = Eigen::VectorXd::Zero(3 * s.model.node_count());
    return rest;
  }
  State::Reached reached;
  reached.converged = true;
  s.iterations_left = s.options.most_iterations;
  const Vec3 from = s.displacement_mm;
  const int parts =
      std::max(1, static_cast<int>(std::ceil((displacement_mm - from).norm() / s.options.longest_step_mm)));
  for (int part = 1; part <= parts && reached.converged; ++part)
    reached = s.move_to(from + (displacement_mm - from) * part / parts, 0);
  return s.answer(reached);
}

}  // namespace palpate
