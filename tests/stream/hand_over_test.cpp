#include "palpate/stream/hand_over.h"

#include <gtest/gtest.h>

#include <thread>

namespace palpate {
namespace {

/// Torn where not all numbers are the same.
struct Many {
  std::array<uint64_t, 12> numbers{};
  bool whole() const {
    for (const uint64_t number : numbers)
      if (number != numbers[0]) return false;
    return true;
  }
};

Many many(uint64_t number) {
  Many value;
  value.numbers.fill(number);
  return value;
}

constexpr uint64_t kValues = 200000;

TEST(HandOver, GivesWholeValuesThatNeverGrowOlder) {
  HandOver<Many> hand_over;
  std::thread writer([&] {
    for (uint64_t i = 1; i <= kValues; ++i) hand_over.write(many(i));
  });
  uint64_t last = 0;
  while (last < kValues) {
    const Many& value = hand_over.read();
    ASSERT_TRUE(value.whole());
    ASSERT_GE(value.numbers[0], last);
    last = value.numbers[0];
  }
  writer.join();
}

TEST(HandOver, TellsWhetherAValueIsNew) {
  HandOver<int> hand_over;
  bool fresh = true;
  hand_over.read(&fresh);
  EXPECT_FALSE(fresh);
  hand_over.write(1);
  hand_over.write(2);
  EXPECT_EQ(hand_over.read(&fresh), 2);
  EXPECT_TRUE(fresh);
  EXPECT_EQ(hand_over.read(&fresh), 2);
  EXPECT_FALSE(fresh);
}

TEST(Broadcast, GivesWholeValuesToEveryReader) {
  Broadcast<Many> broadcast;
  const auto read_all = [&] {
    uint64_t last = 0;
    while (last < kValues) {
      const Many value = broadcast.read();
      ASSERT_TRUE(value.whole());
      ASSERT_GE(value.numbers[0], last);
      last = value.numbers[0];
    }
  };
  std::thread first(read_all), second(read_all);
  for (uint64_t i = 1; i <= kValues; ++i) broadcast.write(many(i));
  first.join();
  second.join();
}

}  // namespace
}  // namespace palpate
