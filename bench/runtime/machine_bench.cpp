#include "bench/runtime/machine_limits.h"
#include "bench/runtime/samples.h"

// What one thread of this machine can do, beside which the other figures are to be read.
namespace palpate::bench {
namespace {

void DgemmOfOneThread(benchmark::State& state) {
  Dgemm work;
  Samples samples;
  for (auto _ : state) samples.time(state, [&] { work.run(); });
  samples.report(state, 0, 0);
  state.counters["GFLOP_per_s"] = 1e-6 * Dgemm::kFlop / state.counters["median_ms"];
}
BENCHMARK(DgemmOfOneThread)->UseManualTime()->Iterations(20);

void TriadOfOneThread(benchmark::State& state) {
  Triad work;
  Samples samples;
  for (auto _ : state) samples.time(state, [&] { work.run(); });
  samples.report(state, 0, 0);
  state.counters["GB_per_s"] = 1e-6 * Triad::kBytes / state.counters["median_ms"];
}
BENCHMARK(TriadOfOneThread)->UseManualTime()->Iterations(20);

}  // namespace
}  // namespace palpate::bench
