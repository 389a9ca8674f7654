#pragma once

#include <map>

#include "palpate/elastic/tet_model.h"

namespace palpate::test {

/// A body some of whose nodes are held where one says.
struct PrescribedEquilibrium {
  bool converged = false;
  int iterations = 0;
  Eigen::VectorXd u;      ///< mm, 3 per node
  Eigen::VectorXd force;  ///< internal force on every node, N: what holds the prescribed ones, zero at the others
};

/// Plain Newton with exact tangents and a line search on the energy; `model` has the nodes of `imposed_mm` among its
/// fixed ones. The displacements are imposed in `steps` even steps. Converged: the largest force on a free node is
/// below 1e-10 of the largest on a held one.
PrescribedEquilibrium solve_prescribed(const TetModel& model, const std::map<int, Vec3>& imposed_mm, int steps = 1);

/// The nodes that are imposed, as TetModel wants them.
std::vector<int> nodes_of(const std::map<int, Vec3>& imposed_mm);

}  // namespace palpate::test
