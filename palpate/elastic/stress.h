#pragma once

#include "palpate/elastic/tet_model.h"

namespace palpate {

/// Von Mises of the Cauchy stress (Eq. 5), one per element, kPa.
std::vector<double> element_von_mises_kPa(const TetModel& model, const Eigen::VectorXd& u);

/// Mean over the elements around each node, weighted by their rest volume, kPa.
std::vector<double> node_von_mises_kPa(const TetModel& model, const Eigen::VectorXd& u);

}  // namespace palpate
