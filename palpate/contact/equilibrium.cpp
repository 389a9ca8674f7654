#include "palpate/contact/equilibrium.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "palpate/contact/lbfgs_history.h"

namespace palpate {

namespace {

constexpr int kMaxHalvings = 12;
constexpr int kMaxSubdivisions = 5;
/// Steps with the old factor and its L-BFGS history go on as long as they make the residual fall to kEnoughFraction in
/// every kPatience of them.
constexpr int kPatience = 4;
constexpr double kEnoughFraction = 0.3;
/// Such a step is taken when the slope along it has turned by no more than this fraction: the energy fell (approximate
/// Wolfe condition, Hager and Zhang 2005), without its having to be computed.
constexpr double kTurnedSlope = 0.8;
constexpr int kMaxTries = 5;
/// Steps of one call that a fresh factor would need as well.
constexpr int kFreshSteps = 3;
/// Newton steps solve their linear system to such a fraction of its residual (in the norm of the preconditioner).
constexpr double kMinGradientFraction = 0.03, kMaxGradientFraction = 0.3;
/// What a new factor costs, in solves.
constexpr int kFactorCost = 40;
/// The contact stiffness is wanted to a per cent of a per cent.
constexpr double kStiffnessFraction = 0.01;
/// A step is continued when the tip moves on within this cosine of its direction, and not farther than this.
constexpr double kSameDirection = 0.9, kFarthestAhead = 2;

double largest_nodal_norm(const Eigen::VectorXd& v) {
  double largest = 0;
  for (Eigen::Index i = 0; i + 2 < v.size(); i += 3) largest = std::max(largest, v.segment<3>(i).norm());
  return largest;
}

Eigen::SparseMatrix<double> stacked(const std::vector<Eigen::SparseMatrix<double>>& parts, int columns) {
  Eigen::Index rows = 0;
  std::vector<Eigen::Triplet<double>> entries;
  for (const Eigen::SparseMatrix<double>& part : parts) {
    for (Eigen::Index column = 0; column < part.outerSize(); ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator entry(part, column); entry; ++entry)
        entries.emplace_back(rows + entry.row(), entry.col(), entry.value());
    rows += part.rows();
  }
  Eigen::SparseMatrix<double> whole(rows, columns);
  whole.setFromTriplets(entries.begin(), entries.end());
  return whole;
}

}  // namespace

struct EquilibriumSolver::State {
  /// The rows of J that belong to one contact.
  struct Contact {
    Eigen::SparseMatrix<double> J;
    Eigen::VectorXd begin_mm;  // J u where it began
  };

  const TetModel& model;
  EquilibriumOptions options;
  std::vector<Contact> contacts;
  Eigen::SparseMatrix<double> J;  // of all contacts
  std::unique_ptr<BorderedSystem> system;
  std::vector<int> order;  // of elimination
  LbfgsHistory history;
  Eigen::VectorXd u;                // unknowns of the last equilibrium
  Eigen::VectorXd lambda;           // its multipliers
  Eigen::VectorXd displacement_mm;  // of each contact in turn
  int iterations_left = 0;
  int factorizations = 0;

  int solves_left = 0;
  struct Step {
    Eigen::VectorXd du;
    Eigen::VectorXd dp_mm;
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

  /// J u for the displacements `p` of the contacts.
  Eigen::VectorXd target_of(const Eigen::VectorXd& p) const {
    Eigen::VectorXd target(J.rows());
    Eigen::Index row = 0;
    for (size_t i = 0; i < contacts.size(); ++i) {
      const Eigen::Index rows = contacts[i].J.rows();
      target.segment(row, rows) =
          contacts[i].begin_mm + p.segment<3>(3 * static_cast<Eigen::Index>(i)).replicate(rows / 3, 1);
      row += rows;
    }
    return target;
  }

  bool is_factored() const { return system && system->usable(); }
  ContactSensitivity sensitivity_of(const BorderedSystem::UnitResponse& response) const;

  /// Everything that hangs on which contacts there are; u stays.
  void tie() {
    std::vector<Eigen::SparseMatrix<double>> parts;
    for (const Contact& contact : contacts) parts.push_back(contact.J);
    J = stacked(parts, model.unknown_count());
    history.clear();
    system.reset();
    if (!contacts.empty()) {
      system = std::make_unique<BorderedSystem>(model, J, order);
      order = system->order();
    }
    lambda = Eigen::VectorXd::Zero(J.rows());
    last_step = earlier_step = {};
  }

  double energy(const Eigen::VectorXd& reduced) const { return model.energy(model.expand(reduced)); }
  bool exhausted() const { return iterations_left <= 0 || solves_left <= 0; }

  Trial evaluate(Eigen::VectorXd reduced, const Eigen::VectorXd& target) const {
    Trial trial;
    trial.u = std::move(reduced);
    trial.full = model.expand(trial.u);
    trial.f_int = model.reduce(model.internal_force(trial.full));
    trial.g = target - J * trial.u;
    trial.lambda = system->multipliers(trial.f_int);
    const Eigen::VectorXd contact = J.transpose() * trial.lambda;
    trial.unbalanced = trial.f_int + contact;
    trial.residual =
        largest_nodal_norm(trial.unbalanced) / std::max(largest_nodal_norm(contact), system->negligible_force_N());
    trial.constrained = trial.g.size() == 0 || trial.g.lpNorm<Eigen::Infinity>() < 1e-9;
    return trial;
  }

  /// Only the neo-Hookean energy has a barrier that a step may jump over.
  bool is_admissible(const Eigen::VectorXd& reduced) const {
    return !resists_inversion(model.tissue().law) || std::isfinite(energy(reduced));
  }

  /// Where the last steps lead when the tip goes on in their direction, else the state as it is.
  Trial begin(const Eigen::VectorXd& p, const Eigen::VectorXd& target) const {
    const Eigen::VectorXd dp_mm = p - displacement_mm;
    const std::optional<double> fraction = ahead(dp_mm, last_step);
    if (!fraction) return evaluate(u, target);
    Eigen::VectorXd du = *fraction * last_step.du;
    // With two steps in line, the curve through their ends.
    if (const auto earlier = ahead(last_step.dp_mm, earlier_step); earlier && *earlier > 1 / kFarthestAhead)
      du += *fraction * (1 + *fraction) / (1 + 1 / *earlier) * (last_step.du - *earlier * earlier_step.du);
    const Eigen::VectorXd there = u + du;
    return evaluate(is_admissible(there) ? there : u, target);
  }

  /// How many times the step goes into dp, where it has the same direction.
  static std::optional<double> ahead(const Eigen::VectorXd& dp_mm, const Step& step) {
    if (step.dp_mm.size() != dp_mm.size()) return std::nullopt;
    const double along = dp_mm.dot(step.dp_mm);
    if (!(along > kSameDirection * dp_mm.norm() * step.dp_mm.norm())) return std::nullopt;
    const double fraction = along / step.dp_mm.squaredNorm();
    if (fraction >= kFarthestAhead) return std::nullopt;
    return fraction;
  }

  void keep(const Trial& trial, const Eigen::VectorXd& p) {
    earlier_step = std::exchange(last_step, {trial.u - u, p - displacement_mm});
    u = trial.u;
    lambda = trial.lambda;
    displacement_mm = p;
  }

  /// Newton towards J u = p for one step of the displacement. A failure leaves the state as it was; running out of
  /// solves leaves it where it has come.
  Reached newton(const Eigen::VectorXd& p) {
    const Eigen::VectorXd target = target_of(p);
    Trial trial = begin(p, target);
    if (!system->usable() || system->stale()) {
      solves_left -= kFactorCost;
      ++factorizations;
      if (!system->factorize(model, trial.full)) return {false, trial.residual};
    }
    std::deque<double> residuals;
    bool slow = false;  // the old factor no longer serves, even with its history
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
          slow = residuals.back() > kEnoughFraction * residuals.front();
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
    trial = evaluate(trial.u + step.du, target);
    return true;
  }

  NewtonStep linear_step(const Trial& trial, bool with_tangent) {
    int solves = 1;
    // As exact as the distance from balance asks for.
    const double fraction = std::max(std::clamp(trial.residual, kMinGradientFraction, kMaxGradientFraction),
                                     0.1 * options.relative_residual / trial.residual);
    const Eigen::VectorXd g = trial.constrained ? Eigen::VectorXd::Zero(trial.g.size()) : trial.g;
    const NewtonStep step = with_tangent ? system->solve_at(model, trial.full, trial.f_int, g, fraction, solves)
                                         : system->solve(trial.f_int, g);
    solves_left -= solves;
    return step;
  }

  /// One step with the old factor and its history; false when it leads nowhere.
  bool quasi_newton_step(Trial& trial, const Eigen::VectorXd& target) {
    const Eigen::VectorXd du = history.step(*system, trial.unbalanced);
    --solves_left;
    const double slope = trial.unbalanced.dot(du);
    if (!du.allFinite() || !(slope < 0)) {
      history.clear();
      return false;
    }
    double length = 1;
    for (int attempt = 0; attempt < kMaxTries; ++attempt) {
      const Eigen::VectorXd s = length * du;
      if (!is_admissible(trial.u + s)) {
        length *= 0.5;
        continue;
      }
      Trial next = evaluate(trial.u + s, target);
      const double next_slope = next.unbalanced.dot(du);
      if (!std::isfinite(next_slope)) return false;
      history.add(s, next.unbalanced - trial.unbalanced);
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
    for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
      const double after = energy(trial.u + length * step.du);
      if (!std::isfinite(after)) continue;
      const bool falls = after <= before + 1e-4 * length * std::min(slope, 0.0);
      if (!falls && after > before + 1e-9 * std::abs(before)) continue;
      Trial next = evaluate(trial.u + length * step.du, target);
      if (!falls && next.residual > 0.5 * trial.residual) continue;
      trial = std::move(next);
      return true;
    }
    return false;
  }

  Reached move_to(const Eigen::VectorXd& p, int depth) {
    const Reached reached = newton(p);
    if (reached.converged || depth >= kMaxSubdivisions || exhausted()) return reached;
    const Reached half = move_to(0.5 * (displacement_mm + p), depth + 1);
    return half.converged ? move_to(p, depth + 1) : half;
  }

  std::vector<ContactForce> contact_forces() const {
    std::vector<ContactForce> forces;
    Eigen::Index row = 0;
    for (const Contact& contact : contacts) {
      const Eigen::VectorXd on_tissue = -(contact.J.transpose() * lambda.segment(row, contact.J.rows()));
      row += contact.J.rows();
      ContactForce force;
      int loaded_nodes = 0;
      for (Eigen::Index i = 0; i + 2 < on_tissue.size(); i += 3) {
        const Vec3 nodal_N = on_tissue.segment<3>(i);
        force.force_N += nodal_N;
        force.mean_nodal_force_N += nodal_N.norm();
        loaded_nodes += nodal_N.norm() > 0;
      }
      if (loaded_nodes > 0) force.mean_nodal_force_N /= loaded_nodes;
      forces.push_back(force);
    }
    return forces;
  }

  Equilibrium answer(const Reached& reached) const {
    Equilibrium result;
    result.converged = reached.converged;
    result.residual = reached.residual;
    result.iterations = options.max_iterations - iterations_left;
    result.u = model.expand(u);
    result.lambda = lambda;
    result.smallest_volume_ratio = model.smallest_volume_ratio(result.u);
    result.contacts = contact_forces();
    result.force_N = result.contacts.front().force_N;
    result.mean_nodal_force_N = result.contacts.front().mean_nodal_force_N;
    return result;
  }
};

EquilibriumSolver::EquilibriumSolver(const TetModel& model, const EquilibriumOptions& options)
    : state_(std::make_unique<State>(model, options)) {}
EquilibriumSolver::~EquilibriumSolver() = default;
EquilibriumSolver::EquilibriumSolver(EquilibriumSolver&&) noexcept = default;

void EquilibriumSolver::hold(const Footprint& footprint) {
  release();
  hold_also(footprint);
}

void EquilibriumSolver::hold_also(const Footprint& footprint) {
  State& s = *state_;
  if (s.contacts.empty()) {
    s.u = Eigen::VectorXd::Zero(s.model.unknown_count());
    s.displacement_mm.resize(0);
    s.balanced = true;
  }
  State::Contact contact;
  contact.J = constraint_matrix(s.model, footprint);
  contact.begin_mm = contact.J * s.u;
  s.contacts.push_back(std::move(contact));
  s.displacement_mm.conservativeResize(s.displacement_mm.size() + 3);
  s.displacement_mm.tail<3>().setZero();
  s.tie();
}

void EquilibriumSolver::replace(const std::vector<Footprint>& footprints) {
  State& s = *state_;
  for (size_t i = 0; i < s.contacts.size(); ++i) {
    State::Contact& contact = s.contacts[i];
    contact.J = constraint_matrix(s.model, footprints.at(i));
    contact.begin_mm = Eigen::VectorXd::Zero(contact.J.rows());
    const Eigen::VectorXd moved_mm = contact.J * s.u;
    s.displacement_mm.segment<3>(3 * static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::Matrix3Xd>(moved_mm.data(), 3, moved_mm.size() / 3).rowwise().mean();
  }
  s.balanced = false;
  s.tie();
}

namespace {

/// Columns x, y, z of each contact: the rows of J that one displacement of it moves.
Eigen::MatrixXd unit_displacements(const std::vector<Eigen::Index>& rows_of_contact, Eigen::Index rows) {
  Eigen::MatrixXd E = Eigen::MatrixXd::Zero(rows, 3 * static_cast<Eigen::Index>(rows_of_contact.size()));
  Eigen::Index row = 0;
  for (size_t i = 0; i < rows_of_contact.size(); ++i) {
    const Eigen::Index count = rows_of_contact[i];
    E.block(row, 3 * static_cast<Eigen::Index>(i), count, 3) = Mat3::Identity().replicate(count / 3, 1);
    row += count;
  }
  return E;
}

}  // namespace

ContactSensitivity EquilibriumSolver::State::sensitivity_of(const BorderedSystem::UnitResponse& response) const {
  ContactSensitivity answer;
  answer.motion.resize(3 * model.node_count(), response.du.cols());
  for (Eigen::Index column = 0; column < response.du.cols(); ++column)
    answer.motion.col(column) = model.expand(response.du.col(column));
  answer.force = response.force;
  return answer;
}

void EquilibriumSolver::refresh() {
  State& s = *state_;
  if (!s.system || (s.system->usable() && !s.system->worn())) return;
  ++s.factorizations;
  s.system->factorize(s.model, s.model.expand(s.u));
}

int EquilibriumSolver::factorizations() const {
  return state_->factorizations;
}

ContactSensitivity EquilibriumSolver::sensitivity() const {
  const State& s = *state_;
  if (!s.is_factored()) return {};
  std::vector<Eigen::Index> rows_of_contact;
  for (const State::Contact& contact : s.contacts) rows_of_contact.push_back(contact.J.rows());
  return s.sensitivity_of(s.system->respond(unit_displacements(rows_of_contact, s.J.rows())));
}

ContactSensitivity EquilibriumSolver::sensitivity_with(const std::vector<Footprint>& footprints) const {
  const State& s = *state_;
  if (!s.is_factored()) return {};
  std::vector<Eigen::SparseMatrix<double>> parts;
  std::vector<Eigen::Index> rows_of_contact;
  for (const Footprint& footprint : footprints) {
    parts.push_back(constraint_matrix(s.model, footprint));
    rows_of_contact.push_back(parts.back().rows());
  }
  const Eigen::SparseMatrix<double> rows = stacked(parts, s.model.unknown_count());
  return s.sensitivity_of(s.system->respond(rows, unit_displacements(rows_of_contact, rows.rows())));
}

void EquilibriumSolver::release(size_t number) {
  State& s = *state_;
  s.contacts.erase(s.contacts.begin() + static_cast<std::ptrdiff_t>(number));
  const Eigen::Index after = s.displacement_mm.size() - 3 * static_cast<Eigen::Index>(number) - 3;
  const Eigen::VectorXd moved_up = s.displacement_mm.tail(after);
  s.displacement_mm.conservativeResize(s.displacement_mm.size() - 3);
  s.displacement_mm.tail(after) = moved_up;
  s.balanced = false;
  s.tie();
}

ContactStiffness EquilibriumSolver::contact_stiffness() {
  State& s = *state_;
  ContactStiffness answer;
  if (!s.system) return answer;
  answer.displacement_mm = s.displacement_mm.head<3>();
  answer.force_N = s.contact_forces().front().force_N;
  if (!s.system->usable() && !s.system->factorize(s.model, s.model.expand(s.u))) return answer;
  // B = du/dp minimises B^T K B within J B = I, so that a small error of B counts squared.
  const Eigen::VectorXd no_force = Eigen::VectorXd::Zero(s.u.size());
  Eigen::MatrixXd B(s.u.size(), 3), KB(s.u.size(), 3);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Index rows = s.contacts.front().J.rows();
    Eigen::VectorXd along = Eigen::VectorXd::Zero(s.J.rows());
    along.head(rows) = Vec3::Unit(i).replicate(rows / 3, 1);
    int solves = 0;
    B.col(i) = s.system->solve_at(s.model, s.model.expand(s.u), no_force, along, kStiffnessFraction, solves).du;
    KB.col(i) = s.system->times_stiffness(B.col(i));
  }
  answer.stiffness_N_per_mm = B.transpose() * KB;
  return answer;
}

void EquilibriumSolver::release() {
  state_->contacts.clear();
  state_->system.reset();
}

Equilibrium EquilibriumSolver::solve_all(const std::vector<Vec3>& displacements_mm) {
  State& s = *state_;
  if (!s.system) {
    Equilibrium rest;
    rest.converged = true;
    rest.u = Eigen::VectorXd::Zero(3 * s.model.node_count());
    return rest;
  }
  State::Reached reached;
  reached.converged = true;
  s.iterations_left = s.options.max_iterations;
  const Eigen::VectorXd from = s.displacement_mm;
  Eigen::VectorXd to(from.size());
  double farthest_mm = 0;
  for (size_t i = 0; i < s.contacts.size(); ++i) {
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(i);
    to.segment<3>(at) = displacements_mm.at(i);
    farthest_mm = std::max(farthest_mm, (displacements_mm[i] - from.segment<3>(at)).norm());
  }
  const int parts = std::max(1, static_cast<int>(std::ceil(farthest_mm / s.options.longest_step_mm)));
  s.solves_left = parts * s.options.max_solves;
  if (!s.balanced) reached = s.newton(from);
  for (int part = 1; part <= parts && reached.converged; ++part)
    reached = s.move_to(from + (to - from) * part / parts, 0);
  return s.answer(reached);
}

}  // namespace palpate
