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

}  // namespace
}  // namespace palpate
