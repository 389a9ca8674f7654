#include <random>

#include "bench/runtime/held_organ.h"
#include "bench/runtime/samples.h"
#include "palpate/contact/bordered_system.h"
#include "palpate/contact/equilibrium.h"
#include "tests/support/calculix.h"

namespace palpate::bench {
namespace {

constexpr int kLinear = 0, kAveraged = 1;
constexpr int kPull = 0, kPush = 1, kNeoHookeanPush = 2;
constexpr double kResidual = 1e-6;

double goal_of(const benchmark::State& state, double small, double middle, double large) {
  return state.range(0) < 5000 ? small : state.range(0) < 20000 ? middle : large;
}

Element element_of(const benchmark::State& state) {
  return state.range(1) == kLinear ? Element::linear : Element::averaged;
}

/// A held organ and the solver of its contact.
struct Contact {
  const HeldOrgan& organ;
  TetModel model;
  Footprint footprint;
  EquilibriumSolver solver;

  explicit Contact(const benchmark::State& state, Law law = Law::saint_venant_kirchhoff)
      : organ(held_organ(static_cast<int>(state.range(0)))),
        model(organ.model(element_of(state), law)),
        footprint(make_footprint(model, organ.boundary, organ.touch_mm, kFootprintRadius_mm)),
        solver(model, {.relative_residual = kResidual}) {
    solver.hold(footprint);
  }
};

/// Back and forth between 0.5 and 3 mm, 0.1 mm at a time.
class Sweep {
 public:
  double next() {
    if (depth_mm_ + step_mm_ > 3.01 || depth_mm_ + step_mm_ < 0.49) step_mm_ = -step_mm_;
    return depth_mm_ += step_mm_;
  }

 private:
  double depth_mm_ = 0.5, step_mm_ = 0.1;
};

void AnswerAfterTenthOfMillimetre(benchmark::State& state) {
  const Law law = state.range(2) == kNeoHookeanPush ? Law::neo_hookean : Law::saint_venant_kirchhoff;
  const double sign = state.range(2) == kPull ? 1 : -1;
  Contact contact(state, law);
  Sweep sweep;
  contact.solver.solve(sign * sweep.next() * contact.footprint.normal);
  Samples samples;
  int failed = 0, answers = 0, iterations = 0;
  for (auto _ : state) {
    const Vec3 p = sign * sweep.next() * contact.footprint.normal;
    Equilibrium answer;
    samples.time(state, [&] { answer = contact.solver.solve(p); });
    failed += !answer.converged;
    iterations += answer.iterations;
    ++answers;
  }
  samples.report(state, contact.model.element_count(), goal_of(state, 1, 10, 100));
  state.counters["iterations"] = static_cast<double>(iterations) / answers;
  state.counters["failed"] = failed;
  state.SetLabel(law_name(law) + (sign > 0 ? ", pull" : ", push"));
}

/// The tip anywhere within 2 mm of where it was, up to 4 mm from where it took hold.
void AnswerAfterTwoMillimetres(benchmark::State& state) {
  Contact contact(state);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Vec3 p = contact.footprint.normal;
  contact.solver.solve(p);
  Samples samples;
  int failed = 0;
  for (auto _ : state) {
    Vec3 next;
    do {
      next = p + 2 * Vec3(uniform(random), uniform(random), uniform(random)).normalized();
    } while (next.norm() > 4 || next.dot(contact.footprint.normal) < -1);
    p = next;
    Equilibrium answer;
    samples.time(state, [&] { answer = contact.solver.solve(p); });
    failed += !answer.converged;
  }
  samples.report(state, contact.model.element_count(), goal_of(state, 8, 30, 0));
  state.counters["failed"] = failed;
}

/// A new contact: model, analysis, factor, and the first answer at 2 mm.
void ColdContact(benchmark::State& state) {
  Samples samples;
  int elements = 0;
  for (auto _ : state)
    samples.time(state, [&] {
      Contact contact(state);
      elements = contact.model.element_count();
      benchmark::DoNotOptimize(contact.solver.solve(2 * contact.footprint.normal).force_N);
    });
  samples.report(state, elements, goal_of(state, 8, 80, 0));
}

/// What a haptic loop does: the published stiffness, and how far it drifts from the full answer.
void PublishedStiffness(benchmark::State& state) {
  Contact contact(state);
  const Vec3 normal = contact.footprint.normal;
  contact.solver.solve(1.5 * normal);
  const ContactStiffness published = contact.solver.contact_stiffness();
  Samples samples;
  Vec3 p = 1.5 * normal;
  for (auto _ : state) {
    samples.time(state, [&] {
      Vec3 sum = Vec3::Zero();
      for (int i = 0; i < 1000; ++i) {
        p.x() += 1e-6;
        sum += published.force_at(p);
      }
      benchmark::DoNotOptimize(sum);
    });
  }
  samples.report(state, contact.model.element_count(), 20);  // of a thousand answers: 20 us each
  for (double moved_mm : {0.1, 0.5, 1.0}) {
    const Vec3 full = contact.solver.solve((1.5 + moved_mm) * normal).force_N;
    state.counters["drift_pct_at_" + std::to_string(moved_mm).substr(0, 3)] =
        100 * (published.force_at((1.5 + moved_mm) * normal) - full).norm() / full.norm();
  }
}

void RefreshOfStiffness(benchmark::State& state) {
  Contact contact(state);
  contact.solver.solve(1.5 * contact.footprint.normal);
  Samples samples;
  for (auto _ : state) samples.time(state, [&] { contact.solver.contact_stiffness(); });
  samples.report(state, contact.model.element_count(), 0);
}

/// What one would write first: a new factor for every Newton step.
void AnswerByFullNewton(benchmark::State& state) {
  Contact contact(state);
  const Eigen::SparseMatrix<double> J = constraint_matrix(contact.model, contact.footprint);
  BorderedSystem system(contact.model, J);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(contact.model.unknown_count());
  Sweep sweep;
  Samples samples;
  for (auto _ : state) {
    const Eigen::VectorXd target = (sweep.next() * contact.footprint.normal).replicate(J.rows() / 3, 1);
    samples.time(state, [&] {
      for (int step = 0; step < 20; ++step) {
        const Eigen::VectorXd full = contact.model.expand(u);
        const Eigen::VectorXd f_int = contact.model.reduce(contact.model.internal_force(full));
        const Eigen::VectorXd lambda = system.multipliers(f_int), g = target - J * u;
        if (g.norm() < 1e-9 &&
            (f_int + J.transpose() * lambda).lpNorm<Eigen::Infinity>() < kResidual * lambda.lpNorm<Eigen::Infinity>())
          break;
        if (!system.factorize(contact.model, full)) break;
        u += system.solve(f_int, g).du;
      }
    });
  }
  samples.report(state, contact.model.element_count(), 0);
}

/// A step of 0.1 mm of the nodes under the footprint in CalculiX, with its files.
void AnswerByCalculiX(benchmark::State& state) {
  if (!test::calculix_is_installed()) {
    state.SkipWithError("CalculiX is missing (Debian package calculix-ccx)");
    return;
  }
  const HeldOrgan& organ = held_organ(static_cast<int>(state.range(0)));
  std::map<int, Vec3> imposed_mm;
  for (int node : organ.fixed_nodes) imposed_mm[node] = Vec3::Zero();
  for (const Triangle& t : organ.boundary)
    for (int node : t)
      if ((organ.mesh.nodes_mm[static_cast<size_t>(node)] - organ.touch_mm).norm() < kFootprintRadius_mm)
        imposed_mm[node] = Vec3(0, 0, -0.1);
  Samples samples;
  for (auto _ : state)
    samples.time(state, [&] {
      benchmark::DoNotOptimize(
          test::run_calculix(organ.mesh, {Law::saint_venant_kirchhoff, 27, 0.45, ""}, imposed_mm).u.data());
    });
  samples.report(state, static_cast<int>(organ.mesh.tetrahedra.size()), 0);
}

BENCHMARK(AnswerAfterTenthOfMillimetre)
    ->UseManualTime()
    ->Args({1344, kLinear, kPull})
    ->Args({1344, kAveraged, kPull})
    ->Args({1344, kAveraged, kPush})
    ->Args({1344, kAveraged, kNeoHookeanPush})
    ->Args({10000, kLinear, kPull})
    ->Args({10000, kAveraged, kPull})
    ->Args({10000, kAveraged, kNeoHookeanPush})
    ->Iterations(200);
BENCHMARK(AnswerAfterTenthOfMillimetre)
    ->UseManualTime()
    ->Args({50000, kLinear, kPull})
    ->Args({50000, kAveraged, kPull})
    ->Iterations(60);
BENCHMARK(AnswerAfterTwoMillimetres)
    ->UseManualTime()
    ->Args({1344, kAveraged})
    ->Args({10000, kAveraged})
    ->Iterations(60);
BENCHMARK(ColdContact)->UseManualTime()->Args({1344, kAveraged})->Args({10000, kAveraged})->Iterations(10);
BENCHMARK(PublishedStiffness)->UseManualTime()->Args({1344, kAveraged})->Args({10000, kAveraged})->Iterations(50);
BENCHMARK(RefreshOfStiffness)->UseManualTime()->Args({1344, kAveraged})->Args({10000, kAveraged})->Iterations(20);
BENCHMARK(AnswerByFullNewton)->UseManualTime()->Args({1344, kAveraged})->Args({10000, kAveraged})->Iterations(10);
BENCHMARK(AnswerByCalculiX)->UseManualTime()->Args({1344, kLinear})->Args({10000, kLinear})->Iterations(2);

}  // namespace
}  // namespace palpate::bench
