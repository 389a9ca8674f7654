#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "palpate/contact/equilibrium.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

constexpr int kGesturesPerLaw = 250;
constexpr double kThickness_mm = 20, kDeepest = 0.4;
constexpr int kFrames = 8;
constexpr std::array<Law, 4> kLaws = {Law::saint_venant_kirchhoff, Law::neo_hookean, Law::corotated, Law::linear};

/// Where a path ends: every frame of a gesture comes to one of these.
enum class End { converged, out_of_range, inverted, not_converged, unsound };
constexpr std::array<const char*, 5> kEnds = {"converged", "out_of_range", "inverted", "not_converged", "unsound"};

/// A tip that pushes, pulls or drags, or does one after the other, to a depth of up to 40 % of the thickness.
struct Gesture {
  Vec3 touch_mm, first_mm, second_mm;
  double radius_mm = 2, poisson_ratio = 0.45;

  Vec3 at(int frame) const {
    const double t = 2.0 * frame / kFrames;
    return std::min(t, 1.0) * first_mm + std::max(t - 1, 0.0) * second_mm;
  }
};

Gesture random_gesture(std::mt19937& random) {
  const auto between = [&random](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / std::mt19937::max());
  };
  const auto move = [&]() -> Vec3 {
    const double size = between(0.05, kDeepest) * kThickness_mm, angle = between(0, 2 * std::numbers::pi);
    switch (random() % 3) {
      case 0:
        return {0, 0, size};
      case 1:
        return {0, 0, -size};
      default:
        return {size * std::cos(angle), size * std::sin(angle), 0};
    }
  };
  Gesture gesture{{between(12, 28), between(12, 28), 0}, move(), move() / 2, between(1.5, 5), between(0.3, 0.49)};
  if (gesture.at(kFrames).z() > kDeepest * kThickness_mm) gesture.second_mm.z() = 0;
  return gesture;
}

End end_of(const TetModel& model, const Equilibrium& found, double relative_residual) {
  const bool finite = found.u.allFinite() && found.force_N.allFinite() && std::isfinite(found.residual) &&
                      std::isfinite(found.mean_nodal_force_N) && std::isfinite(found.smallest_volume_ratio);
  if (!finite) return End::unsound;
  if (!found.converged) return End::not_converged;
  if (found.residual > relative_residual) return End::unsound;
  if (found.smallest_volume_ratio <= 0) return End::inverted;
  return model.in_valid_range(found.u) ? End::converged : End::out_of_range;
}

/// The worst that a frame of the gesture comes to.
End run(const Gesture& gesture, Law law) {
  static const TetMesh mesh = test::box_mesh({40, 40, kThickness_mm}, {5, 5, 3});
  static const std::vector<Triangle> boundary = boundary_triangles(mesh);
  const TetModel model(mesh, {law, 27, gesture.poisson_ratio, ""}, test::nodes_at(mesh, 2, kThickness_mm),
                       Element::averaged);
  EquilibriumSolver solver(model);
  solver.hold(make_footprint(model, boundary, gesture.touch_mm, gesture.radius_mm));
  End worst = End::converged;
  for (int frame = 1; frame <= kFrames; ++frame)
    worst = std::max(worst, end_of(model, solver.solve(gesture.at(frame)), EquilibriumOptions{}.relative_residual));
  return worst;
}

TEST(Gestures, AThousandAtRandomEachConvergeOrSayThatTheyDoNot) {
  std::mt19937 random(1);
  for (Law law : kLaws) {
    std::vector<Gesture> gestures;
    for (int i = 0; i < kGesturesPerLaw; ++i) gestures.push_back(random_gesture(random));
    std::vector<End> ends(gestures.size(), End::unsound);
    tbb::parallel_for(size_t{0}, gestures.size(), [&](size_t i) { ends[i] = run(gestures[i], law); });
    fmt::print("{:22}", law_name(law));
    for (size_t e = 0; e < kEnds.size(); ++e) {
      const double fraction = static_cast<double>(std::count(ends.begin(), ends.end(), static_cast<End>(e))) /
                              static_cast<double>(ends.size());
      fmt::print("  {} {:.1f} %", kEnds[e], 100 * fraction);
      std::string key = law_name(law) + "_" + kEnds[e];
      std::replace(key.begin(), key.end(), '-', '_');
      RecordProperty(key, fmt::format("{:.3f}", fraction));
    }
    fmt::print("\n");
    EXPECT_EQ(std::count(ends.begin(), ends.end(), End::unsound), 0) << law_name(law);
    if (law == Law::neo_hookean) {
      EXPECT_GT(std::count(ends.begin(), ends.end(), End::converged), 0.95 * kGesturesPerLaw);
    }
  }
}

}  // namespace
}  // namespace palpate
