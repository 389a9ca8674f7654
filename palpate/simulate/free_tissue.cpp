#include "palpate/simulate/free_tissue.h"

#include "palpate/core/errors.h"
#include "palpate/elastic/sparse_factor.h"

namespace palpate {
namespace {

const int kMaxSteps = 20;
const double kResidual = 1e-9;  // of the largest force on a fixed node

}  // namespace

Eigen::VectorXd stretch_free_tissue(TetModel& model, const Vec3& strain, const Vec3& middle_mm) {
  Eigen::VectorXd affine(3 * model.node_count());
  for (int i = 0; i < model.node_count(); ++i)
    affine.segment<3>(3 * i) = strain.cwiseProduct(model.rest_mm()[static_cast<size_t>(i)] - middle_mm);
  model.set_base(affine);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(model.unknown_count());
  SparseFactor factor;
  Eigen::SparseMatrix<double> K;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::VectorXd u = model.expand(moved), force_N = model.internal_force(u);
    const Eigen::VectorXd unbalanced_N = model.reduce(force_N);
    if (unbalanced_N.lpNorm<Eigen::Infinity>() <= kResidual * force_N.lpNorm<Eigen::Infinity>()) {
      model.set_base(u);
      return u;
    }
    model.tangent(u, true, K);
    if (step == 0) factor.analyze(K);
    if (!factor.factorize(K)) break;
    moved -= factor.solve(unbalanced_N).col(0);
  }
  throw BadInput("simulate.stretch: the tissue has no equilibrium; strain it less or choose another law");
}

}  // namespace palpate
