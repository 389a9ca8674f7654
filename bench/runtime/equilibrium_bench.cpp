#include <benchmark/benchmark.h>

#include "palpate/contact/held_contact.h"
#include "palpate/elastic/sparse_factor.h"
#include "palpate/elastic/stress.h"
#include "palpate/volume/tetrahedralize.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

constexpr double kFootprintRadius_mm = 3;

TetMesh block(int64_t elements) {
  const int cells = static_cast<int>(std::round(std::cbrt(static_cast<double>(elements) / 12)));
  return test::box_mesh({60, 60, 30}, {2 * cells, cells, cells});
}

TissueOptions liver() {
  return {Law::saint_venant_kirchhoff, 27, 0.45, ""};
}

void Tangent(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  const TetModel model(mesh, liver(), test::nodes_at(mesh, 2, 30));
  const Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * model.node_count());
  Eigen::SparseMatrix<double> K;
  for (auto _ : state) model.tangent(u, false, K);
  state.counters["elements"] = model.element_count();
}
BENCHMARK(Tangent)->Arg(1344)->Arg(10000)->Unit(benchmark::kMillisecond);

void Refactorise(benchmark::State& state) {
  const TetMesh mesh = block(state.range(0));
  const TetModel model(mesh, liver(), test::nodes_at(mesh, 2, 30));
  Eigen::SparseMatrix<double> K;
  model.tangent(Eigen::VectorXd::Zero(3 * model.node_count()), false, K);
  SparseFactor factor;
  factor.analyze(K);
  for (auto _ : state) factor.factorize(K);
  state.counters["elements"] = model.element_count();
}
BENCHMARK(Refactorise)->Arg(1344)->Arg(10000)->Unit(benchmark::kMillisecond);

/// One converged answer of Eq. 3 after the tip has moved by 0.1 mm, on a map refined at the footprint.
void ForceAnswer(benchmark::State& state) {
  const Vec3 touch(30, 30, 0);
  const TetMesh mesh = refine_near(block(state.range(0)), touch, 1.2 * kFootprintRadius_mm, 0.5 * kFootprintRadius_mm);
  ContactOptions options;
  options.footprint_radius_mm = kFootprintRadius_mm;
  HeldContact contact(mesh, test::nodes_at(mesh, 2, 30), liver(), touch, options);
  double depth_mm = 1, step_mm = 0.1;
  int iterations = 0;
  for (auto _ : state) {
    depth_mm += step_mm;
    if (depth_mm > 3 || depth_mm < 1) step_mm = -step_mm;
    iterations = contact.move({0, 0, -depth_mm}).equilibrium.iterations;
  }
  state.counters["elements"] = contact.model().element_count();
  state.counters["samples"] = static_cast<double>(contact.footprint().samples.size());
  state.counters["iterations"] = iterations;
}
BENCHMARK(ForceAnswer)->Arg(550)->Arg(1344)->Arg(10000)->Unit(benchmark::kMillisecond);

void BeginContact(benchmark::State& state) {
  const TetMesh coarse = block(state.range(0));
  const Vec3 touch(30, 30, 0);
  for (auto _ : state) {
    const TetMesh mesh = refine_near(coarse, touch, 1.2 * kFootprintRadius_mm, 0.5 * kFootprintRadius_mm);
    const HeldContact contact(mesh, test::nodes_at(mesh, 2, 30), liver(), touch, {});
    benchmark::DoNotOptimize(contact.footprint().samples.size());
  }
}
BENCHMARK(BeginContact)->Arg(1344)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace palpate
