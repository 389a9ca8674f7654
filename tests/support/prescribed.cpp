#include "tests/support/prescribed.h"

#include <cmath>

#include "palpate/elastic/sparse_factor.h"

namespace palpate::test {

namespace {

constexpr int kMaxIterations = 40, kMaxHalvings = 30;
constexpr double kTolerance = 1e-10;

class Newton {
 public:
  explicit Newton(const TetModel& model) : model_(model) {
    model.tangent(Eigen::VectorXd::Zero(3 * model.node_count()), false, K_);
    factor_.analyze(K_);
  }

  /// Moves the held nodes by `du` and the others as the tangent predicts, as far as the energy stays finite.
  void predict(Eigen::VectorXd& u, const Eigen::VectorXd& du) {
    constexpr double kSmall = 1e-6;
    const Eigen::VectorXd slope = (model_.internal_force(u + kSmall * du) - model_.internal_force(u)) / kSmall;
    const Eigen::VectorXd follow = direction(u, model_.reduce(slope));
    u += du;
    double length = 1;
    while (!std::isfinite(model_.energy(u + length * follow)) && length > 1e-3) length *= 0.5;
    u += length * follow;
  }

  /// False where no step leads down.
  bool step(Eigen::VectorXd& u) {
    const Eigen::VectorXd force = model_.reduce(model_.internal_force(u)), du = direction(u, force);
    const double before = model_.energy(u), residual = force.norm();
    double length = 1;
    for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
      const Eigen::VectorXd next = u + length * du;
      const double after = model_.energy(next);
      if (!std::isfinite(after)) continue;
      if (after > before && model_.reduce(model_.internal_force(next)).norm() > residual) continue;
      u = next;
      return true;
    }
    return false;
  }

 private:
  Eigen::VectorXd direction(const Eigen::VectorXd& u, const Eigen::VectorXd& reduced_force) {
    for (bool project : {false, true}) {
      model_.tangent(u, project, K_);
      if (factor_.factorize(K_)) break;
    }
    return model_.expand(factor_.solve(Eigen::MatrixXd(-reduced_force)));
  }

  const TetModel& model_;
  Eigen::SparseMatrix<double> K_;
  SparseFactor factor_;
};

}  // namespace

PrescribedEquilibrium solve_prescribed(const TetModel& model, const std::map<int, Vec3>& imposed_mm, int steps) {
  Eigen::VectorXd end = Eigen::VectorXd::Zero(3 * model.node_count());
  for (const auto& [node, u] : imposed_mm) end.segment<3>(3 * node) = u;
  PrescribedEquilibrium found;
  found.u = Eigen::VectorXd::Zero(end.size());
  Newton newton(model);
  for (int step = 1; step <= steps; ++step) {
    newton.predict(found.u, end / steps);
    found.converged = false;
    for (int i = 0; i < kMaxIterations; ++i, ++found.iterations) {
      found.force = model.internal_force(found.u);
      const double unbalanced = model.reduce(found.force).lpNorm<Eigen::Infinity>();
      found.converged = unbalanced <= kTolerance * found.force.lpNorm<Eigen::Infinity>();
      if (found.converged || !newton.step(found.u)) break;
    }
    if (!found.converged) break;
  }
  return found;
}

std::vector<int> nodes_of(const std::map<int, Vec3>& imposed_mm) {
  std::vector<int> nodes;
  for (const auto& entry : imposed_mm) nodes.push_back(entry.first);
  return nodes;
}

}  // namespace palpate::test
