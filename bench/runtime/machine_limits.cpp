#include "bench/runtime/machine_limits.h"

#include <cblas.h>

#include <algorithm>

#include "palpate/core/stopwatch.h"

namespace palpate::bench {

namespace {

template <class Work>
double median_ms_of(Work work) {
  std::vector<double> ms;
  Stopwatch watch;
  for (int i = 0; i < 20; ++i) {
    work.run();
    ms.push_back(watch.lap_ms());
  }
  std::sort(ms.begin(), ms.end());
  return ms[ms.size() / 2];
}

}  // namespace

Dgemm::Dgemm() : a_(static_cast<size_t>(kSize) * kSize, 1.5), b_(a_.size(), 0.5), c_(a_.size()) {
  openblas_set_num_threads(1);
}

void Dgemm::run() {
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, kSize, kSize, kSize, 1, a_.data(), kSize, b_.data(), kSize, 0,
              c_.data(), kSize);
}

Triad::Triad() : a_(8'000'000), b_(a_.size(), 1), c_(a_.size(), 2) {}

void Triad::run() {
  for (size_t i = 0; i < a_.size(); ++i) a_[i] = b_[i] + 3 * c_[i];
  asm volatile("" : : "r"(a_.data()) : "memory");
}

double dgemm_GFLOP_per_s() {
  return 1e-6 * Dgemm::kFlop / median_ms_of(Dgemm());
}

double triad_GB_per_s() {
  return 1e-6 * Triad::kBytes / median_ms_of(Triad());
}

}  // namespace palpate::bench
