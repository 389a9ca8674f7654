#pragma once

#include "palpate/elastic/tet_model.h"

namespace palpate {

/// Eq. 5 of the paper.
double von_mises(const Mat3& stress);

/// Von Mises of the Cauchy stress, one per element, kPa.
std::vector<double> element_von_mises_kPa(const TetModel& model, const Eigen::VectorXd& u);

/// Mean over the elements around each node, weighted by their deformed volume, kPa. Elements that are turned inside out
/// have no Cauchy stress and are left out; 0 where there is no other.
std::vector<double> node_von_mises_kPa(const TetModel& model, const Eigen::VectorXd& u);

}  // namespace palpate
