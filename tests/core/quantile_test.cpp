#include "palpate/core/quantile.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Quantile, IsOneOfTheValuesAndLeavesThemWhereTheyAre) {
  const std::vector<double> values = {5, 1, 4, 2, 3};
  EXPECT_EQ(median_of(values), 3);
  EXPECT_EQ(quantile_of(values, 0), 1);
  EXPECT_EQ(quantile_of(values, 0.5), 3);
  EXPECT_EQ(quantile_of(values, 1), 5);
  EXPECT_EQ(values, (std::vector<double>{5, 1, 4, 2, 3}));
  EXPECT_EQ(median_of(std::vector<int>{4, 1, 3, 2}), 3) << "the upper one of the two in the middle";
}

TEST(Quantile, OfNothingIsNothing) {
  EXPECT_EQ(median_of(std::vector<double>{}), 0);
  EXPECT_EQ(quantile_of(std::vector<float>{}, 0.9), 0.0F);
}

}  // namespace
}  // namespace palpate
