#include "palpate/stream/passive_force.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <random>

namespace palpate {
namespace {

/// Tissue that stiffens: W = k/2 |q|^2 + a/4 |q|^4.
struct Tissue {
  double k = 0.3, a = 0.02;
  double energy(const Vec3& q) const { return 0.5 * k * q.squaredNorm() + 0.25 * a * std::pow(q.squaredNorm(), 2); }
  Vec3 force(const Vec3& q) const { return (k + a * q.squaredNorm()) * q; }
  Mat3 stiffness(const Vec3& q) const {
    return (k + a * q.squaredNorm()) * Mat3::Identity() + 2 * a * q * q.transpose();
  }
};

ContactSpring spring_at(const Tissue& tissue, const Vec3& tip_mm, double told = 1) {
  ContactSpring spring;
  spring.valid = spring.in_contact = true;
  spring.tip_mm = tip_mm;
  spring.force_N = told * tissue.force(tip_mm);
  spring.tangent.stiffness_N_per_mm = told * tissue.stiffness(tip_mm);
  spring.tangent.displacement_mm = tip_mm;
  return spring;
}

/// Smooth, from rest to rest.
struct ClosedPath {
  std::array<Vec3, 4> sines;
  double seconds;

  ClosedPath(std::mt19937& random, double s) : seconds(s) {
    std::normal_distribution<double> normal(0, 1);
    for (Vec3& sine : sines) sine = {normal(random), normal(random), normal(random)};
  }
  Vec3 at(double t) const {
    const double angle = std::numbers::pi * t / seconds;
    Vec3 q = Vec3::Zero();
    for (size_t i = 0; i < sines.size(); ++i)
      q += std::sin(angle * static_cast<double>(2 * i + 1)) / static_cast<double>(i + 1) * sines[i];
    return q * std::sin(angle);
  }
};

struct Tour {
  double extracted_Nmm = 0, stored_Nmm = 0, error_N = 0, peak_N = 0;
};

/// 1 kHz steps, frames at 25 per second that arrive late, and are wrong by `deviation` each.
Tour tour(std::mt19937& random, double deviation, int late_ms) {
  const Tissue tissue;
  const ClosedPath path(random, std::uniform_real_distribution<double>(1, 4)(random));
  std::normal_distribution<double> told(1, deviation);
  PassiveForce force({50, 1000});
  std::deque<std::pair<int, ContactSpring>> on_the_way;
  Vec3 frame_tip = Vec3::Zero(), last_tip = path.at(0), last_force = Vec3::Zero();
  Tour result;
  double work_Nmm = 0;
  const int end_ms = static_cast<int>(1000 * path.seconds);
  for (int ms = 0; ms <= end_ms; ++ms) {
    const Vec3 tip = path.at(0.001 * ms);
    if (ms % 40 == 0) on_the_way.emplace_back(ms + late_ms, spring_at(tissue, tip, told(random)));
    if (!on_the_way.empty() && on_the_way.front().first <= ms) {
      force.use(on_the_way.front().second);
      frame_tip = on_the_way.front().second.tip_mm;
      on_the_way.pop_front();
    }
    work_Nmm += last_force.dot(tip - last_tip);
    const SteppedForce step = force.step(tip, tip - frame_tip, true, 0.001);
    last_force = step.force_N;
    last_tip = tip;
    result.stored_Nmm = std::max(result.stored_Nmm, tissue.energy(tip));
    result.peak_N = std::max(result.peak_N, tissue.force(tip).norm());
    if (ms > 200) result.error_N = std::max(result.error_N, (step.force_N - tissue.force(tip)).norm());
  }
  result.extracted_Nmm = std::max(0.0, -work_Nmm);
  return result;
}

TEST(PassiveForce, GivesBackNoMoreThanWasPutInOverClosedPaths) {
  std::mt19937 random(1);
  double worst = 0;
  for (double deviation : {0.0, 0.05, 0.2})
    for (int late_ms : {0, 30, 60})
      for (int i = 0; i < 20; ++i) {
        const Tour t = tour(random, deviation, late_ms);
        worst = std::max(worst, t.extracted_Nmm / t.stored_Nmm);
      }
  RecordProperty("worst_extracted_over_stored", std::to_string(worst));
  std::printf("[ figure   ] extracted over stored, worst of 180 tours: %.4f\n", worst);
  EXPECT_LT(worst, 0.02);
}

TEST(PassiveForce, FollowsTheTissueWhereTheFramesAreRight) {
  std::mt19937 random(2);
  std::vector<double> ratios;
  for (int i = 0; i < 40; ++i) {
    const Tour t = tour(random, 0, 0);
    ratios.push_back(t.error_N / t.peak_N);
  }
  std::sort(ratios.begin(), ratios.end());
  std::printf("[ figure   ] greatest error over peak: median %.3f, worst %.3f\n", ratios[20], ratios.back());
  EXPECT_LT(ratios[20], 0.1);
}

TEST(PassiveForce, StiffnessThatIsReplacedOnTheWayBackMakesNoEnergy) {
  // Loaded softly, unloaded stiffly: without its guard this spring would give back three times what it took.
  PassiveForce force({50, 1e4});
  const Tissue soft{0.1, 0}, stiff{0.3, 0};
  double work_Nmm = 0;
  Vec3 last_tip = Vec3::Zero(), last_force = Vec3::Zero(), frame_tip = Vec3::Zero();
  const auto step = [&](const Vec3& tip) {
    work_Nmm += last_force.dot(tip - last_tip);
    last_force = force.step(tip, tip - frame_tip, true, 0.001).force_N;
    last_tip = tip;
  };
  force.use(spring_at(soft, Vec3::Zero()));
  for (int ms = 0; ms <= 500; ++ms) step({0, 0, 0.01 * ms});
  frame_tip = last_tip;
  force.use(spring_at(stiff, last_tip));
  for (int ms = 0; ms < 100; ++ms) step(last_tip);
  for (int ms = 500; ms >= 0; --ms) step({0, 0, 0.01 * ms});
  EXPECT_GT(work_Nmm, -0.02 * soft.energy({0, 0, 5}));
}

TEST(PassiveForce, RampsToNothingWithin20MillisecondsWhenFramesStayAway) {
  PassiveForce force({50, 1000});
  force.use(spring_at({}, {0, 0, 4}));
  for (int ms = 0; ms < 200; ++ms) force.step({0, 0, 4}, Vec3::Zero(), true, 0.001);
  double last_N = force.step({0, 0, 4}, Vec3::Zero(), true, 0.001).force_N.norm();
  const double full_N = last_N;
  ASSERT_NEAR(full_N, Tissue{}.force({0, 0, 4}).norm(), 1e-3);
  for (int ms = 1; ms <= 20; ++ms) {
    const SteppedForce step = force.step({0, 0, 4}, Vec3::Zero(), false, 0.001);
    EXPECT_FALSE(step.valid);
    EXPECT_LE(last_N - step.force_N.norm(), 0.06 * full_N);  // no kick
    EXPECT_LE(step.force_N.norm(), last_N + 1e-9);
    last_N = step.force_N.norm();
  }
  EXPECT_NEAR(last_N, 0, 1e-9);
}

TEST(PassiveForce, KeepsItsLimits) {
  PassiveForce force({1.5, 20});
  Vec3 last = Vec3::Zero();
  bool limited = false;
  for (int ms = 0; ms < 400; ++ms) {
    if (ms % 40 == 0) force.use(spring_at({}, Vec3(0, 0, ms % 80 == 0 ? 1 : 9)));
    const SteppedForce step = force.step({0, 0, 5}, Vec3::Zero(), true, 0.001);
    EXPECT_LE(step.force_N.norm(), 1.5 + 1e-9);
    EXPECT_LE((step.force_N - last).norm(), 0.02 + 1e-9);
    limited |= step.limited;
    last = step.force_N;
  }
  EXPECT_TRUE(limited);
}

TEST(PassiveForce, AnInvalidFrameIsInvalidAtOnce) {
  PassiveForce force({5, 100});
  force.use(spring_at({}, {0, 0, 2}));
  for (int ms = 0; ms < 100; ++ms) EXPECT_TRUE(force.step({0, 0, 2}, Vec3::Zero(), true, 0.001).valid);
  force.use(ContactSpring{});
  EXPECT_FALSE(force.step({0, 0, 2}, Vec3::Zero(), true, 0.001).valid);
}

TEST(ContactSpring, APushNeverPullsAndKeepsItsFrictionCone) {
  ForceEstimate estimate;
  estimate.status = FrameStatus::ok;
  estimate.in_contact = true;
  estimate.grip = Hold::push;
  estimate.force_N = {0.2, 0, 1};
  estimate.tangent.normal = {0, 0, -1};
  estimate.tangent.stiffness_N_per_mm = Mat3::Identity();
  const ContactSpring spring = contact_spring(estimate, 0.3, 0);
  EXPECT_LT((force_at(spring, Vec3::Zero()) - Vec3(0.2, 0, 1)).norm(), 1e-12);
  EXPECT_LT((force_at(spring, {5, 0, 0}) - Vec3(0.3, 0, 1)).norm(), 1e-12);
  EXPECT_EQ(force_at(spring, {0, 0, -2}), Vec3::Zero());
}

TEST(ContactSpring, HasNoStiffnessThatPushesByItself) {
  ForceEstimate estimate;
  estimate.status = FrameStatus::ok;
  estimate.in_contact = true;
  estimate.grip = Hold::grasp;
  estimate.tangent.stiffness_N_per_mm << 1, 0.5, 0, -0.5, -2, 0, 0, 0, 3;
  const Mat3 K = contact_spring(estimate, 0.3, 0).tangent.stiffness_N_per_mm;
  EXPECT_LT((K - Mat3(Vec3(1, 0, 3).asDiagonal())).norm(), 1e-12);
}

TEST(ContactSpring, StoredEnergyOfALinearSpringIsHalfForceTimesWay) {
  const Tissue tissue{0.4, 0};
  const ContactSpring spring = spring_at(tissue, {1, 2, 3});
  const Mat3 K = tissue.stiffness(Vec3::Zero());
  EXPECT_NEAR(stored_energy_Nmm(spring, K, Vec3::Zero()), tissue.energy({1, 2, 3}), 1e-12);
  EXPECT_NEAR(stored_energy_Nmm(spring, K, {-1, 0, 2}), tissue.energy({0, 2, 5}), 1e-12);
}

}  // namespace
}  // namespace palpate
