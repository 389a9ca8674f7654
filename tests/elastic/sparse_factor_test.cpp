#include "palpate/elastic/sparse_factor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace palpate {
namespace {

/// Lower triangle of the Laplacian on a cube of n^3 cells.
Eigen::SparseMatrix<double> laplacian(int n) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n * n * n; ++i) {
    entries.emplace_back(i, i, 7);
    if (i % n > 0) entries.emplace_back(i, i - 1, -1);
    if (i / n % n > 0) entries.emplace_back(i, i - n, -1);
    if (i / (n * n) > 0) entries.emplace_back(i, i - n * n, -1);
  }
  Eigen::SparseMatrix<double> lower(n * n * n, n * n * n);
  lower.setFromTriplets(entries.begin(), entries.end());
  return lower;
}

std::vector<int> order_of(int n) {
  SparseFactor factor;
  factor.analyze(laplacian(n));
  return factor.order();
}

TEST(SparseFactor, OrdersTheSameWhateverAnotherThreadOrdersMeanwhile) {
  const std::vector<int> alone = order_of(14);
  std::atomic<bool> is_done = false;
  std::thread other([&] {
    for (int n = 8; !is_done; n = n % 12 + 8) order_of(n);
  });
  int others = 0;
  for (int i = 0; i < 30; ++i) others += order_of(14) != alone;
  is_done = true;
  other.join();
  EXPECT_EQ(others, 0);
}

TEST(SparseFactor, SolvesRoughlyTheSameInEveryUnitOfStiffness) {
  const Eigen::SparseMatrix<double> A = laplacian(6);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 2);
  const auto solved = [&](double stiffness) {
    SparseFactor factor;
    const Eigen::SparseMatrix<double> scaled = stiffness * A;
    factor.analyze(scaled);
    EXPECT_TRUE(factor.factorize(scaled));
    return factor.solve_roughly(stiffness * b);
  };
  const Eigen::VectorXd x = solved(1);
  EXPECT_LT((A.selfadjointView<Eigen::Lower>() * x - b).norm(), 1e-5 * b.norm());
  for (const double stiffness : {1e-60, 1e60}) EXPECT_LT((solved(stiffness) - x).norm(), 1e-7 * x.norm()) << stiffness;
}

TEST(SparseFactor, SolvesRoughlyForNothingWhereNothingPulls) {
  SparseFactor factor;
  const Eigen::SparseMatrix<double> A = laplacian(3);
  factor.analyze(A);
  ASSERT_TRUE(factor.factorize(A));
  EXPECT_TRUE(factor.solve_roughly(Eigen::VectorXd::Zero(A.rows())).isZero(0));
}

}  // namespace
}  // namespace palpate
