#include "palpate/instrument/stereo_synchronization.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

/// What is found after 16 frames of a tip that moves by `step_px` rows per frame, with the right camera ahead by `lag`
/// frames and its rows 2 px lower.
std::optional<int> found_lag(double step_px, int lag, bool with_a_gap = false) {
  StereoSynchronization synchronization;
  const auto row = [&](double t) { return 200 + step_px * t + 0.1 * step_px * t * std::sin(0.4 * t); };
  for (int t = 0; t < 16; ++t) {
    const double jitter = 0.4 * std::sin(12.9 * t), other_jitter = 0.4 * std::cos(7.7 * t);
    synchronization.add(with_a_gap && t > 10 ? t + 3 : t, row(t) + jitter, row(t + lag) + 2 + other_jitter);
  }
  return synchronization.frames();
}

TEST(StereoSynchronization, TellsWhichEyeIsAhead) {
  EXPECT_EQ(found_lag(3, 0), 0);
  EXPECT_EQ(found_lag(3, 1), 1);
  EXPECT_EQ(found_lag(-3, -1), -1);
}

TEST(StereoSynchronization, SaysNothingOfATipThatStaysInItsRow) {
  EXPECT_FALSE(found_lag(0.1, 1).has_value());
}

TEST(StereoSynchronization, IsNotMisledByTheNoiseOfTheRows) {
  int told = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> noise_px(0, 1.5);
    StereoSynchronization synchronization;
    for (int t = 0; t < 40; ++t) {
      const double row = 200 + 6 * std::sin(0.3 * t);
      synchronization.add(t, row + noise_px(generator), row + noise_px(generator));
      told += synchronization.frames().value_or(0) != 0;
    }
  }
  EXPECT_LT(told, 30) << "of 5800";
}

TEST(StereoSynchronization, SaysNothingRightAfterDroppedFrames) {
  EXPECT_FALSE(found_lag(3, 1, true).has_value());
}

}  // namespace
}  // namespace palpate
