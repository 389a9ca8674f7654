#include "palpate/feedback/axis.h"

#include <gmock/gmock.h>

namespace palpate {
namespace {

TEST(Axis, RoundsUpToOneTwoFive) {
  EXPECT_DOUBLE_EQ(round_up(0.9), 1);
  EXPECT_DOUBLE_EQ(round_up(1), 1);
  EXPECT_DOUBLE_EQ(round_up(1.01), 2);
  EXPECT_DOUBLE_EQ(round_up(3), 5);
  EXPECT_DOUBLE_EQ(round_up(51), 100);
  EXPECT_DOUBLE_EQ(round_up(0.013), 0.02);
  EXPECT_DOUBLE_EQ(round_up(0), 1);
}

TEST(Axis, TicksAreRoundAndInside) {
  EXPECT_THAT(round_ticks(0, 100, 5),
              testing::Pointwise(testing::DoubleNear(1e-9), std::vector<double>{0, 20, 40, 60, 80, 100}));
  EXPECT_THAT(round_ticks(-7, 12, 4), testing::Pointwise(testing::DoubleNear(1e-9), std::vector<double>{-5, 0, 5, 10}));
  EXPECT_THAT(round_ticks(0, 0.5, 5),
              testing::Pointwise(testing::DoubleNear(1e-9), std::vector<double>{0, 0.1, 0.2, 0.3, 0.4, 0.5}));
}

TEST(Axis, WritesTicksWithoutNeedlessDigits) {
  EXPECT_EQ(tick_text(0.30000000000000004), "0.3");
  EXPECT_EQ(tick_text(-1e-15), "0");
  EXPECT_EQ(tick_text(1000), "1000");
}

TEST(Axis, WritesValuesWithThreeDigits) {
  EXPECT_EQ(three_digits(12.345), "12.3");
  EXPECT_EQ(three_digits(0.4567), "0.457");
  EXPECT_EQ(three_digits(1234.5), "1234");
  EXPECT_EQ(three_digits(0), "0");
}

}  // namespace
}  // namespace palpate
