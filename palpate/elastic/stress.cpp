#include "palpate/elastic/stress.h"

#include <Eigen/LU>
#include <cmath>

namespace palpate {

namespace {
constexpr double kKiloPascalPerMegaPascal = 1e3;
}

double von_mises(const Mat3& s) {
  const double xy = s(0, 0) - s(1, 1), yz = s(1, 1) - s(2, 2), zx = s(2, 2) - s(0, 0);
  const double shear = s(0, 1) * s(0, 1) + s(1, 2) * s(1, 2) + s(2, 0) * s(2, 0);
  return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx + 6 * shear));
}

std::vector<double> element_von_mises_kPa(const TetModel& model, const Eigen::VectorXd& u) {
  std::vector<double> stress(static_cast<size_t>(model.element_count()));
  for (int e = 0; e < model.element_count(); ++e)
    stress[static_cast<size_t>(e)] =
        kKiloPascalPerMegaPascal *
        von_mises(cauchy_stress(model.tissue().law, model.lame(e), model.deformation_gradient(u, e)));
  return stress;
}

std::vector<double> node_von_mises_kPa(const TetModel& model, const Eigen::VectorXd& u) {
  const std::vector<double> of_element = element_von_mises_kPa(model, u);
  std::vector<double> sum(static_cast<size_t>(model.node_count()), 0.0), weight = sum;
  for (int e = 0; e < model.element_count(); ++e) {
    const double volume_mm3 = model.deformation_gradient(u, e).determinant() * model.rest_volume_mm3(e);
    if (volume_mm3 <= 0) continue;
    for (int node : model.tetrahedra()[static_cast<size_t>(e)]) {
      sum[static_cast<size_t>(node)] += volume_mm3 * of_element[static_cast<size_t>(e)];
      weight[static_cast<size_t>(node)] += volume_mm3;
    }
  }
  for (size_t n = 0; n < sum.size(); ++n)
    if (weight[n] > 0) sum[n] /= weight[n];
  return sum;
}

}  // namespace palpate
