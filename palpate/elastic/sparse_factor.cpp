#include "palpate/elastic/sparse_factor.h"

#include <cblas.h>
#include <cholmod.h>

#include <cstring>
#include <mutex>
#include <stdexcept>
#include <vector>

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

/// The supernodes of a CHOLMOD factor in single precision, free of the unit of stiffness: what is rounded is the same
/// for a soft body as for a stiff one.
struct RoughFactor {
  double scale = 1;           // of L: its first entry
  std::vector<float> values;  // of L / scale, supernode by supernode, column-major

  void copy(const cholmod_factor& factor) {
    const auto* x = static_cast<const double*>(factor.x);
    scale = factor.xsize > 0 ? x[0] : 1;
    values.resize(factor.xsize);
    for (size_t i = 0; i < factor.xsize; ++i) values[i] = static_cast<float>(x[i] / scale);
  }

  /// L L^T x = P b, supernode by supernode.
  Eigen::VectorXd solve(const cholmod_factor& factor, const Eigen::VectorXd& b) const {
    const auto* first_column = static_cast<const int*>(factor.super);
    const auto* first_row = static_cast<const int*>(factor.pi);
    const auto* first_value = static_cast<const int*>(factor.px);
    const auto* row_number = static_cast<const int*>(factor.s);
    const auto* permutation = static_cast<const int*>(factor.Perm);
    const auto n = static_cast<size_t>(b.size());
    std::vector<float> x(n), below(factor.maxesize + 1);
    const double largest = b.lpNorm<Eigen::Infinity>();
    if (!(largest > 0)) return Eigen::VectorXd::Zero(b.size());
    for (size_t i = 0; i < n; ++i) x[i] = static_cast<float>(b[permutation[i]] / largest);
    struct Supernode {
      int columns, rows;  // rows beneath the columns' own
      const float *own, *beneath;
      const int* row_number;
      float* x;
      int stride;
    };
    const auto supernode = [&](size_t k) {
      const int columns = first_column[k + 1] - first_column[k], stride = first_row[k + 1] - first_row[k];
      const float* own = values.data() + first_value[k];
      return Supernode{columns,
                       stride - columns,
                       own,
                       own + columns,
                       row_number + first_row[k] + columns,
                       x.data() + first_column[k],
                       stride};
    };
    for (size_t k = 0; k < factor.nsuper; ++k) {
      const Supernode s = supernode(k);
      cblas_strsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, s.columns, s.own, s.stride, s.x, 1);
      if (s.rows == 0) continue;
      cblas_sgemv(CblasColMajor, CblasNoTrans, s.rows, s.columns, 1, s.beneath, s.stride, s.x, 1, 0, below.data(), 1);
      for (int r = 0; r < s.rows; ++r) x[static_cast<size_t>(s.row_number[r])] -= below[static_cast<size_t>(r)];
    }
    for (size_t k = factor.nsuper; k-- > 0;) {
      const Supernode s = supernode(k);
      if (s.rows > 0) {
        for (int r = 0; r < s.rows; ++r) below[static_cast<size_t>(r)] = x[static_cast<size_t>(s.row_number[r])];
        cblas_sgemv(CblasColMajor, CblasTrans, s.rows, s.columns, -1, s.beneath, s.stride, below.data(), 1, 1, s.x, 1);
      }
      cblas_strsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, s.columns, s.own, s.stride, s.x, 1);
    }
    const double unit = largest / (scale * scale);
    Eigen::VectorXd result(b.size());
    for (size_t i = 0; i < n; ++i) result[permutation[i]] = unit * x[i];
    return result;
  }
};

}  // namespace

struct SparseFactor::State {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;
  RoughFactor rough;

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

  /// `part`: which of CHOLMOD's systems.
  Eigen::MatrixXd solve(int part, const Eigen::MatrixXd& B) {
    cholmod_dense view{};
    view.nrow = static_cast<size_t>(B.rows());
    view.ncol = static_cast<size_t>(B.cols());
    view.nzmax = static_cast<size_t>(B.size());
    view.d = static_cast<size_t>(B.rows());
    view.x = const_cast<double*>(B.data());
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    cholmod_dense* x = cholmod_solve(part, factor, &view, &common);
    if (!x) throw std::runtime_error("SparseFactor: solve failed");
    Eigen::MatrixXd X = Eigen::Map<Eigen::MatrixXd>(static_cast<double*>(x->x), B.rows(), B.cols());
    cholmod_free_dense(&x, &common);
    return X;
  }
};

SparseFactor::SparseFactor() : state_(std::make_unique<State>()) {}
SparseFactor::~SparseFactor() = default;
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;

void SparseFactor::analyze(const Eigen::SparseMatrix<double>& lower, const std::vector<int>& order) {
  cholmod_sparse view = lower_view(lower);
  cholmod_free_factor(&state_->factor, &state_->common);
  const bool is_given = order.size() == view.nrow;
  state_->common.method[0].ordering = is_given ? CHOLMOD_GIVEN : CHOLMOD_METIS;
  // METIS draws from the C library's generator and seeds it anew: alone, it finds the same order each time.
  static std::mutex one_at_a_time;
  const std::lock_guard<std::mutex> lock(one_at_a_time);
  state_->factor = is_given ? cholmod_analyze_p(&view, const_cast<int*>(order.data()), nullptr, 0, &state_->common)
                            : cholmod_analyze(&view, &state_->common);
  if (!state_->factor) throw std::runtime_error("SparseFactor: symbolic analysis failed");
}

std::vector<int> SparseFactor::order() const {
  const auto* permutation = static_cast<const int*>(state_->factor->Perm);
  return {permutation, permutation + state_->factor->n};
}

bool SparseFactor::factorize(const Eigen::SparseMatrix<double>& lower) {
  cholmod_sparse view = lower_view(lower);
  cholmod_factorize(&view, state_->factor, &state_->common);
  if (state_->common.status != CHOLMOD_OK || state_->factor->minor != state_->factor->n) return false;
  state_->rough.copy(*state_->factor);
  return true;
}

double SparseFactor::operations() const {
  return state_->common.fl;
}

Eigen::VectorXd SparseFactor::solve_roughly(const Eigen::VectorXd& b) const {
  return state_->rough.solve(*state_->factor, b);
}

Eigen::MatrixXd SparseFactor::solve(const Eigen::MatrixXd& B) const {
  return state_->solve(CHOLMOD_A, B);
}

Eigen::MatrixXd SparseFactor::half_solve(const Eigen::MatrixXd& B) const {
  return state_->solve(CHOLMOD_L, state_->solve(CHOLMOD_P, B));
}

}  // namespace palpate
