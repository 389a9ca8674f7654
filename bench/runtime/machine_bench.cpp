#include <cblas.h>

#include "bench/runtime/samples.h"

// What one thread of this machine can do, beside which the other figures are to be read.
namespace palpate::bench {
namespace {

void Dgemm(benchmark::State& state) {
  const int n = 1000;
  const std::vector<double> a(static_cast<size_t>(n) * n, 1.5), b(a.size(), 0.5);
  std::vector<double> c(a.size());
  openblas_set_num_threads(1);
  Samples samples;
  for (auto _ : state)
    samples.time(state, [&] {
      cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, n, n, n, 1, a.data(), n, b.data(), n, 0, c.data(), n);
    });
  samples.report(state, 0, 0);
  state.counters["GFLOP_per_s"] = 2e-6 * n * n * n / state.counters["median_ms"];
}
BENCHMARK(Dgemm)->UseManualTime()->Iterations(20);

void Triad(benchmark::State& state) {
  const size_t n = 8'000'000;
  std::vector<double> a(n), b(n, 1), c(n, 2);
  Samples samples;
  for (auto _ : state)
    samples.time(state, [&] {
      for (size_t i = 0; i < n; ++i) a[i] = b[i] + 3 * c[i];
      benchmark::DoNotOptimize(a.data());
    });
  samples.report(state, 0, 0);
  state.counters["GB_per_s"] = 1e-6 * 3 * sizeof(double) * static_cast<double>(n) / state.counters["median_ms"];
}
BENCHMARK(Triad)->UseManualTime()->Iterations(20);

}  // namespace
}  // namespace palpate::bench
