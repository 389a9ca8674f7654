#pragma once

#include <vector>

namespace palpate::bench {

/// One product of two dense matrices, on one thread.
class Dgemm {
 public:
  Dgemm();
  void run();
  static constexpr int kSize = 1000;
  static constexpr double kFlop = 2.0 * kSize * kSize * kSize;

 private:
  std::vector<double> a_, b_, c_;
};

/// a = b + 3 c over more than any cache holds, on one thread.
class Triad {
 public:
  Triad();
  void run();
  static constexpr double kBytes = 3.0 * sizeof(double) * 8e6;

 private:
  std::vector<double> a_, b_, c_;
};

/// Of twenty runs, the median.
double dgemm_GFLOP_per_s();
double triad_GB_per_s();

}  // namespace palpate::bench
