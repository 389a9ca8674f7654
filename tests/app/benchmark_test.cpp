#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <vector>

#include "tests/app/program.h"

namespace palpate::test {
namespace {

using testing::HasSubstr;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::stringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

TEST(Benchmark, ExportsSequencesThatItsScorerScoresAsCompareDoes) {
  const Workspace workspace;
  const std::filesystem::path folder = workspace / "benchmark";
  const Outcome outcome = run_palpate("benchmark export " + folder.string() + " --only uterus");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_THAT(outcome.output, HasSubstr("1 sequences, "));
  for (const char* file : {"README.md", "score.py", "uterus/left.mp4", "uterus/scene.yaml", "uterus/truth.csv",
                           "results/uterus/forces.csv", "results/scores.csv"})
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << file;

  const std::string ours = read_file(folder / "results/scores.csv");
  const Outcome scored = run(
      "/usr/bin/python3", (folder / "score.py").string() + " " + folder.string() + " " + (folder / "results").string());
  ASSERT_EQ(scored.exit_code, 0) << scored.error;
  std::stringstream by_compare(ours), by_script(read_file(folder / "results/scores.csv"));
  std::string line, other;
  ASSERT_TRUE(std::getline(by_compare, line) && std::getline(by_script, other));
  EXPECT_EQ(fields_of(line).size(), 11u);
  ASSERT_TRUE(std::getline(by_compare, line) && std::getline(by_script, other));
  const auto a = fields_of(line), b = fields_of(other);
  ASSERT_EQ(a.size(), 11u) << line;
  ASSERT_EQ(b.size(), 11u) << other;
  EXPECT_EQ(a[0], "uterus");
  for (size_t i = 1; i < a.size(); ++i)
    EXPECT_NEAR(std::stod(a[i]), std::stod(b[i]), 1e-3 * std::abs(std::stod(a[i])) + 1e-9) << i;
}

TEST(Benchmark, NamesItsSequencesWhereOneIsAskedForThatIsNone) {
  const Workspace workspace;
  const Outcome outcome = run_palpate("benchmark export " + (workspace / "benchmark").string() + " --only kidney");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.error, testing::AllOf(HasSubstr("kidney"), HasSubstr("breathing_slab"), HasSubstr("uterus")));
  EXPECT_FALSE(std::filesystem::exists(workspace / "benchmark"));
}

}  // namespace
}  // namespace palpate::test
