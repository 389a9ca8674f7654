#pragma once

#include <deque>

#include "palpate/contact/bordered_system.h"

namespace palpate {

/// Curvature seen between states with the same constraint (L-BFGS, Nocedal 1980), which corrects an old factor.
class LbfgsHistory {
 public:
  void clear() { pairs_.clear(); }

  /// `s`: difference of two states; `y`: of their unbalanced forces. Taken only where the energy curves upwards.
  void add(const Eigen::VectorXd& s, const Eigen::VectorXd& y);

  /// Step of descent for the unbalanced force, on top of the factored stiffness.
  Eigen::VectorXd step(const BorderedSystem& system, const Eigen::VectorXd& unbalanced) const;

 private:
  struct Pair {
    Eigen::VectorXd s, y;
    double inverse_sy;
  };
  std::deque<Pair> pairs_;
};

}  // namespace palpate
