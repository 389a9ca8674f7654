#include "palpate/contact/equilibrium.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

namespace palpate {

namespace {

constexpr int kMostHalvings = 12;
constexpr int kMostSubdivisions = 5;
/// Secants of earlier steps that correct the old factor, and the steps that they may take while they make the residual
/// fall by kEnoughShare in every kPatience of them.
constexpr size_t kSecants = 8;
constexpr int kPatience = 4;
constexpr double kEnoughShare = 0.3;
/// Such a step is taken when the slope along it has turned by no more than this share: the energy fell (approximate
/// Wolfe condition, Hager and Zhang 2005), without its having to be computed.
constexpr double kTurnedSlope = 0.8;
constexpr int kMostTries = 5;
/// Quasi-Newton steps of one call that a fresh factor would need as well.
constexpr int kFreshSteps = 3;
/// Conjugate gradients stop at such a share of the residual (in the norm of the preconditioner) or after so many steps.
constexpr double kLeastGradientShare = 0.03, kMostGradientShare = 0.3;
constexpr int kMostGradients = 40;
/// Steps of conjugate gradients on one factor that have cost more than a new one.
constexpr int kStaleGradients = 80;
/// What a new factor and a new tangent cost, in solves.
constexpr int kFactorCost = 40, kTangentCost = 4;
/// A step is continued when the tip moves on within this cosine of its direction, and not farther than this.
constexpr double kSameDirection = 0.9, kFarthestAhead = 2;
/// rho over the mean diagonal of K at rest. With 1, A is indefinite in equilibria of a deep push whose K is positive
/// definite along the constraint, and Newton falls back to the slow projected tangent there; from 10 on it is not.
constexpr double kConstraintWeight = 100;

struct NewtonStep {
  Eigen::VectorXd du;      // on the unknowns
  Eigen::VectorXd lambda;  // new multipliers
};

/// Eq. 3 by Schur complement on a factored stiffness A = K + rho J^T J of some earlier state, on one fixed pattern:
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
    JJt_.compute(Eigen::MatrixXd(J * J.transpose()));
  }

  /// False when even the projected tangent cannot be factored.
  bool factorize(const TetModel& model, const Eigen::VectorXd& u) {
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

  bool usable() const { return usable_; }
  bool stale() const { return gradients_ > kStaleGradients; }
  /// Steps that the age of the factor has cost.
  void age(int steps) { gradients_ += std::max(0, steps); }
  double rho() const { return rho_; }
  Eigen::Index constraint_count() const { return J_.rows(); }
  /// The multipliers that balance these forces best.
  Eigen::VectorXd multipliers(const Eigen::VectorXd& f_int) const { return -JJt_.solve(J_ * f_int); }

  /// With the factored state's stiffness.
  NewtonStep solve(const Eigen::VectorXd& f_int, const Eigen::VectorXd& g) const {
    const Eigen::VectorXd a = factor_.solve_roughly(-f_int + rho_ * (J_.transpose() * g));
    NewtonStep step;
    step.lambda = schur_.solve(J_ * a - g);
    step.du = a - Y_ * step.lambda;
    step.du += J_.transpose() * JJt_.solve(g - J_ * step.du);
    return step;
  }

  /// With the stiffness at `u`: conjugate gradients within J du = g, preconditioned by `solve` (Gould, Hribar, Nocedal
  /// 2001), until the residual has fallen to `share`. Where the stiffness is not positive the step ends; with g = 0 it
  /// is still one of descent.
  NewtonStep solve_at(const TetModel& model, const Eigen::VectorXd& u, const Eigen::VectorXd& f_int,
                      const Eigen::VectorXd& g, bool constrained, double share, int& solves) {
    model.tangent(u, false, K_);
    const Eigen::VectorXd still = Eigen::VectorXd::Zero(J_.rows());
    Eigen::VectorXd residual = f_int, du = Eigen::VectorXd::Zero(f_int.size());
    if (!constrained) {
      du = solve(f_int, g).du;
      residual += K_.selfadjointView<Eigen::Lower>() * du;
    }
    NewtonStep step = solve(residual, still);
    Eigen::VectorXd along = step.du;
    step.du = du;
    double slope = -residual.dot(along);
    const double enough = share * share * slope;
    int gradients = constrained ? 1 : 2;
    for (; gradients < kMostGradients && slope > enough; ++gradients) {
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

 private:
  Eigen::SparseMatrix<double> J_, K_, JtJ_, A_;
  SparseFactor factor_;
  Eigen::MatrixXd Y_;  // A^-1 J^T
  Eigen::LDLT<Eigen::MatrixXd> schur_, JJt_;
  double rho_ = 0;
  int gradients_ = 0;  // since the last factorisation
  bool usable_ = false;
};

/// Curvature seen between states with the same constraint (L-BFGS; Nocedal 1980): s = du, y = change of the force.
class Secants {
 public:
  void clear() { pairs_.clear(); }

  void add(const Eigen::VectorXd& s, const Eigen::VectorXd& y) {
    const double sy = s.dot(y);
    if (sy <= 1e-8 * s.norm() * y.norm()) return;
    if (pairs_.size() == kSecants) pairs_.pop_front();
    pairs_.push_back({s, y, 1 / sy});
  }

  /// Step of descent for the unbalanced force, on top of the factored stiffness.
  Eigen::VectorXd step(const BorderedSystem& system, const Eigen::VectorXd& unbalanced) const {
    Eigen::VectorXd q = unbalanced;
    std::vector<double> alpha(pairs_.size());
    for (size_t i = pairs_.size(); i-- > 0;) {
      alpha[i] = pairs_[i].inverse_sy * pairs_[i].s.dot(q);
      q -= alpha[i] * pairs_[i].y;
    }
    Eigen::VectorXd du = system.solve(q, Eigen::VectorXd::Zero(system.constraint_count())).du;
    for (size_t i = 0; i < pairs_.size(); ++i)
      du -= (alpha[i] + pairs_[i].inverse_sy * pairs_[i].y.dot(du)) * pairs_[i].s;
    return du;
  }

 private:
  struct Pair {
    Eigen::VectorXd s, y;
    double inverse_sy;
  };
  std::deque<Pair> pairs_;
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
  Secants secants;
  Eigen::VectorXd u;       // unknowns of the last equilibrium
  Eigen::VectorXd lambda;  // its multipliers
  Vec3 displacement_mm = Vec3::Zero();
  int iterations_left = 0;

  int solves_left = 0;
  struct Step {
    Eigen::VectorXd du;
    Vec3 dp_mm = Vec3::Zero();
  };
  Step last_step, earlier_step;
  bool balanced = true;  // u is an equilibrium, not just where the solves ran out

  struct Reached {
    bool converged = false;
    double residual = 0;
  };

  /// A point on the way, and how far from balance it is.
  struct Trial {
    Eigen::VectorXd u, lambda;  // on the unknowns; multipliers that balance f_int best
    Eigen::VectorXd full, f_int, g, unbalanced;
    double residual = 0;
    bool constrained = false;
  };

  State(const TetModel& m, const EquilibriumOptions& o) : model(m), options(o) {}

  double energy(const Eigen::VectorXd& reduced) const { return model.energy(model.expand(reduced)); }
  bool exhausted() const { return iterations_left <= 0 || solves_left <= 0; }

  Trial weigh(Eigen::VectorXd reduced, const Eigen::VectorXd& target) const {
    Trial trial;
    trial.u = std::move(reduced);
    trial.full = model.expand(trial.u);
    trial.f_int = model.reduce(model.internal_force(trial.full));
    trial.g = target - J * trial.u;
    trial.lambda = system->multipliers(trial.f_int);
    const Eigen::VectorXd contact = J.transpose() * trial.lambda;
    trial.unbalanced = trial.f_int + contact;
    trial.residual = largest_nodal_norm(trial.unbalanced) /
                     std::max(largest_nodal_norm(contact), 1e-9 * system->rho() / kConstraintWeight);
    trial.constrained = trial.g.size() == 0 || trial.g.lpNorm<Eigen::Infinity>() < 1e-9;
    return trial;
  }

  /// Only the neo-Hookean energy has a barrier that a step may jump over.
  bool is_admissible(const Eigen::VectorXd& reduced) const {
    return model.tissue().law != Law::neo_hookean || std::isfinite(energy(reduced));
  }

  /// Where the last steps lead when the tip goes on in their direction, else the state as it is.
  Trial begin(const Vec3& p, const Eigen::VectorXd& target) const {
    const Vec3 dp_mm = p - displacement_mm;
    const std::optional<double> share = ahead(dp_mm, last_step);
    if (!share) return weigh(u, target);
    Eigen::VectorXd du = *share * last_step.du;
    // With two steps in line, the curve through their ends.
    if (const auto earlier = ahead(last_step.dp_mm, earlier_step); earlier && *earlier > 1 / kFarthestAhead)
      du += *share * (1 + *share) / (1 + 1 / *earlier) * (last_step.du - *earlier * earlier_step.du);
    const Eigen::VectorXd there = u + du;
    return weigh(is_admissible(there) ? there : u, target);
  }

  /// How many times the step goes into dp, where it has the same direction.
  static std::optional<double> ahead(const Vec3& dp_mm, const Step& step) {
    const double along = dp_mm.dot(step.dp_mm);
    if (!(along > kSameDirection * dp_mm.norm() * step.dp_mm.norm())) return std::nullopt;
    const double share = along / step.dp_mm.squaredNorm();
    if (share >= kFarthestAhead) return std::nullopt;
    return share;
  }

  void keep(const Trial& trial, const Vec3& p) {
    earlier_step = std::exchange(last_step, {trial.u - u, p - displacement_mm});
    u = trial.u;
    lambda = trial.lambda;
    displacement_mm = p;
  }

  /// Newton towards J u = p for one step of the displacement. A failure leaves the state as it was; running out of
  /// solves leaves it where it has come.
  Reached newton(const Vec3& p) {
    const Eigen::VectorXd target = p.replicate(J.rows() / 3, 1);
    Trial trial = begin(p, target);
    if (!system->usable() || system->stale()) {
      solves_left -= kFactorCost;
      if (!system->factorize(model, trial.full)) return {false, trial.residual};
    }
    std::deque<double> residuals;
    bool slow = false;  // the old factor no longer serves, even with secants
    int quasi_steps = 0;
    for (;;) {
      if (trial.constrained && (trial.residual <= options.relative_residual || exhausted())) {
        system->age(quasi_steps - kFreshSteps);
        keep(trial, p);
        balanced = trial.residual <= options.relative_residual;
        return {balanced, trial.residual};
      }
      if (exhausted()) return {false, trial.residual};
      --iterations_left;
      if (trial.constrained && !slow) {
        residuals.push_back(trial.residual);
        if (residuals.size() > kPatience) {
          slow = residuals.back() > kEnoughShare * residuals.front();
          residuals.pop_front();
        }
      }
      const bool advanced = !trial.constrained ? constrain(trial, target, slow)
                            : slow             ? newton_step(trial, target)
                                               : quasi_newton_step(trial, target);
      quasi_steps += trial.constrained && !slow;
      if (advanced) continue;
      if (slow) return {false, trial.residual};
      slow = true;
    }
  }

  /// The whole step that brings the footprint to its place; false when it would invert an element.
  bool constrain(Trial& trial, const Eigen::VectorXd& target, bool with_tangent) {
    const NewtonStep step = linear_step(trial, with_tangent);
    if (!step.du.allFinite() || !is_admissible(trial.u + step.du)) return false;
    trial = weigh(trial.u + step.du, target);
    return true;
  }

  NewtonStep linear_step(const Trial& trial, bool with_tangent) {
    int solves = 1;
    // As exact as the distance from balance asks for.
    const double share = std::max(std::clamp(trial.residual, kLeastGradientShare, kMostGradientShare),
                                  0.1 * options.relative_residual / trial.residual);
    const NewtonStep step =
        with_tangent ? system->solve_at(model, trial.full, trial.f_int, trial.g, trial.constrained, share, solves)
                     : system->solve(trial.f_int, trial.g);
    solves_left -= solves;
    return step;
  }

  /// One step with the old factor and the secants; false when it leads nowhere.
  bool quasi_newton_step(Trial& trial, const Eigen::VectorXd& target) {
    const Eigen::VectorXd du = secants.step(*system, trial.unbalanced);
    --solves_left;
    const double slope = trial.unbalanced.dot(du);
    if (!du.allFinite() || !(slope < 0)) {
      secants.clear();
      return false;
    }
    double length = 1;
    for (int attempt = 0; attempt < kMostTries; ++attempt) {
      const Eigen::VectorXd s = length * du;
      if (!is_admissible(trial.u + s)) {
        length *= 0.5;
        continue;
      }
      Trial next = weigh(trial.u + s, target);
      const double next_slope = next.unbalanced.dot(du);
      if (!std::isfinite(next_slope)) return false;
      secants.add(s, next.unbalanced - trial.unbalanced);
      if (next_slope <= -kTurnedSlope * slope) {
        trial = std::move(next);
        return true;
      }
      length *= std::clamp(slope / (slope - next_slope), 0.1, 0.9);
    }
    return false;
  }

  /// One step with the stiffness of the moment; false when it leads nowhere.
  bool newton_step(Trial& trial, const Eigen::VectorXd& target) {
    const NewtonStep step = linear_step(trial, true);
    if (!step.du.allFinite()) return false;
    // Along the constraint the energy has to fall (Armijo). Near the solution rounding hides that; the residual tells.
    const double before = energy(trial.u), slope = trial.f_int.dot(step.du);
    double length = 1;
    for (int halving = 0; halving < kMostHalvings; ++halving, length *= 0.5) {
      const double after = energy(trial.u + length * step.du);
      if (!std::isfinite(after)) continue;
      const bool falls = after <= before + 1e-4 * length * std::min(slope, 0.0);
      if (!falls && after > before + 1e-9 * std::abs(before)) continue;
      Trial next = weigh(trial.u + length * step.du, target);
      if (!falls && next.residual > 0.5 * trial.residual) continue;
      trial = std::move(next);
      return true;
    }
    return false;
  }

  Reached move_to(const Vec3& p, int depth) {
    const Reached reached = newton(p);
    if (reached.converged || depth >= kMostSubdivisions || exhausted()) return reached;
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
  s.secants.clear();
  s.system = std::make_unique<BorderedSystem>(s.model, s.J);
  s.u = Eigen::VectorXd::Zero(s.model.unknown_count());
  s.lambda = Eigen::VectorXd::Zero(s.J.rows());
  s.displacement_mm.setZero();
  s.last_step = s.earlier_step = {};
  s.balanced = true;
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
  s.solves_left = parts * s.options.most_solves;
  if (!s.balanced) reached = s.newton(from);
  for (int part = 1; part <= parts && reached.converged; ++part)
    reached = s.move_to(from + (displacement_mm - from) * part / parts, 0);
  return s.answer(reached);
}

}  // namespace palpate
