#include <Eigen/SparseCholesky>

#include "bench/runtime/held_organ.h"
#include "bench/runtime/samples.h"
#include "palpate/elastic/sparse_factor.h"

namespace palpate::bench {
namespace {

double goal_of(const benchmark::State& state, double small, double middle, double large) {
  return state.range(0) < 5000 ? small : state.range(0) < 20000 ? middle : large;
}

Element element_of(const benchmark::State& state) {
  return state.range(1) == 0 ? Element::linear : Element::averaged;
}

Eigen::SparseMatrix<double> rest_tangent(const TetModel& model) {
  Eigen::SparseMatrix<double> K;
  model.tangent(Eigen::VectorXd::Zero(3 * model.node_count()), false, K);
  return K;
}

void Assembly(benchmark::State& state) {
  const TetModel model = held_organ(static_cast<int>(state.range(0))).model(element_of(state));
  const Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * model.node_count());
  Eigen::SparseMatrix<double> K;
  Samples samples;
  for (auto _ : state) samples.time(state, [&] { model.tangent(u, false, K); });
  samples.report(state, model.element_count(), goal_of(state, 0.4, 1.7, 8.5));
}

void Refactorisation(benchmark::State& state) {
  const TetModel model = held_organ(static_cast<int>(state.range(0))).model(element_of(state));
  const Eigen::SparseMatrix<double> K = rest_tangent(model);
  SparseFactor factor;
  factor.analyze(K);
  Samples samples;
  for (auto _ : state) samples.time(state, [&] { factor.factorize(K); });
  samples.report(state, model.element_count(), goal_of(state, 2.0, 42, 460));
  state.counters["GFLOP_per_s"] = 1e-6 * factor.operations() / state.counters["median_ms"];
}

void RefactorisationByEigen(benchmark::State& state) {
  const TetModel model = held_organ(static_cast<int>(state.range(0))).model(element_of(state));
  const Eigen::SparseMatrix<double> K = rest_tangent(model);
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor;
  factor.analyzePattern(K);
  Samples samples;
  for (auto _ : state) samples.time(state, [&] { factor.factorize(K); });
  samples.report(state, model.element_count(), 0);
}

constexpr int kLinear = 0, kAveraged = 1;

#define PALPATE_SIZES(name)      \
  BENCHMARK(name)                \
      ->UseManualTime()          \
      ->Args({1344, kLinear})    \
      ->Args({1344, kAveraged})  \
      ->Args({10000, kLinear})   \
      ->Args({10000, kAveraged}) \
      ->Args({50000, kLinear})   \
      ->Args({50000, kAveraged})

PALPATE_SIZES(Assembly);
PALPATE_SIZES(Refactorisation);
BENCHMARK(RefactorisationByEigen)->UseManualTime()->Args({1344, kLinear})->Args({10000, kLinear})->Iterations(5);

}  // namespace
}  // namespace palpate::bench
