#include "palpate/feedback/warnings.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

ForceRow row_with(const std::string& warnings) {
  ForceRow row;
  row.warnings = warnings;
  return row;
}

TEST(Warnings, AreCountedByName) {
  const std::map<std::string, int> counts =
      count_warnings({row_with("sliding"), row_with(""), row_with("near_attachment;sliding")});
  EXPECT_EQ(counts, (std::map<std::string, int>{{"near_attachment", 1}, {"sliding", 2}}));
}

TEST(Warnings, HaveWordsAndAnUnknownOneStandsForItself) {
  EXPECT_EQ(warning_words("near_attachment"), "contact close to where the tissue is held");
  EXPECT_EQ(warning_words("of_another_program"), "of_another_program");
}

}  // namespace
}  // namespace palpate
