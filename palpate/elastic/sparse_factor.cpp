#include "palpate/elastic/sparse_factor.h"

#include <cblas.h>
#include <cholmod.h>

#include <cstring>
#include <stdexcept>

namespace palpate {

namespace {

/// A view of Eigen's matrix for CHOLMOD: same arrays, nothing copied.
cholmod_sparse lower_view(const Eigen::SparseMatrix<double>& lower) {
  cholmod_sparse view{};
  view.nrow = static_cast<size_t>(lower.rows());
  view.ncol = static_cast<size_t>(lower.cols());
  view.nzmax = static_cast<size_t>(lower.nonZeros());
  view.p = const_cast<int*>(lower.outerIndexPtr());
  view.i = const_cast<int*>(lower.innerIndexPtr());
  view.x = const_cast<double*>(lower.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

}  // namespace

struct SparseFactor::State {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;

  State() {
    // OpenBLAS's own threads slow small supernodes down; work is spread over cores above it.
    openblas_set_num_threads(1);
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
    common.postorder = 1;
  }
  ~State() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
};

SparseFactor::SparseFactor() : state_(std::make_unique<State>()) {}
SparseFactor::~SparseFactor() = default;
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;

void SparseFactor::analyze(const Eigen::SparseMatrix<double>& lower) {
  cholmod_sparse view = lower_view(lower);
  cholmod_free_factor(&state_->factor, &state_->common);
  state_->factor = cholmod_analyze(&view, &state_->common);
  if (!state_->factor) throw std::runtime_error("SparseFactor: symbolic analysis failed");
}

bool SparseFactor::factorize(const Eigen::SparseMatrix<double>& lower) {
  cholmod_sparse view = lower_view(lower);
  cholmod_factorize(&view, state_->factor, &state_->common);
  return state_->common.status == CHOLMOD_OK && state_->factor->minor == state_->factor->n;
}

Eigen::MatrixXd SparseFactor::solve(const Eigen::MatrixXd& B) const {
  cholmod_dense view{};
  view.nrow = static_cast<size_t>(B.rows());
  view.ncol = static_cast<size_t>(B.cols());
  view.nzmax = static_cast<size_t>(B.size());
  view.d = static_cast<size_t>(B.rows());
  view.x = const_cast<double*>(B.data());
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, state_->factor, &view, &state_->common);
  if (!x) throw std::runtime_error("SparseFactor: solve failed");
  Eigen::MatrixXd X = Eigen::Map<Eigen::MatrixXd>(static_cast<double*>(x->x), B.rows(), B.cols());
  cholmod_free_dense(&x, &state_->common);
  return X;
}

}  // namespace palpate
