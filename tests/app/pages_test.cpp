#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>

#include "tests/app/program.h"

namespace palpate::test {
namespace {

const std::filesystem::path kSource = PALPATE_SOURCE_DIR;

/// "Suite.Name" of every test in tests/.
std::set<std::string> names_of_tests() {
  static const std::regex kTest(R"(TEST(?:_F|_P)?\((\w+),\s*(\w+)\))");
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kSource / "tests")) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = read_file(entry.path());
    for (std::sregex_iterator it(text.begin(), text.end(), kTest), end; it != end; ++it)
      names.insert((*it)[1].str() + "." + (*it)[2].str());
  }
  return names;
}

TEST(SafetyPage, NamesTestsThatExist) {
  static const std::regex kNamed(R"(`([A-Z]\w+\.[A-Z]\w+)`)");
  const std::string page = read_file(kSource / "docs/safety.md");
  const std::set<std::string> tests = names_of_tests();
  int named = 0;
  for (std::sregex_iterator it(page.begin(), page.end(), kNamed), end; it != end; ++it, ++named)
    EXPECT_TRUE(tests.count((*it)[1])) << "docs/safety.md names " << (*it)[1] << ", which is no test";
  EXPECT_GT(named, 40);
}

TEST(SafetyPage, HasATestForEveryHazard) {
  const std::string page = read_file(kSource / "docs/safety.md");
  const size_t begin = page.find("## Hazards"), end = page.find("## What is not modelled");
  ASSERT_LT(begin, end);
  static const std::regex kRow(R"(\n\| [a-zY][^\n]*)"), kNamed(R"(`[A-Z]\w+\.[A-Z]\w+`)");
  const std::string hazards = page.substr(begin, end - begin);
  int rows = 0;
  for (std::sregex_iterator it(hazards.begin(), hazards.end(), kRow), last; it != last; ++it) {
    const std::string row = it->str();
    if (row.starts_with("\n| cause")) continue;
    ++rows;
    EXPECT_TRUE(std::regex_search(row, kNamed)) << row;
  }
  EXPECT_GT(rows, 20);
}

TEST(ContributingPage, NamesFilesThatExist) {
  static const std::regex kNamed(R"(`((?:palpate|tests|bench|docs|app|fuzz|cmake|packaging)/[\w/.-]+)`)");
  const std::string page = read_file(kSource / "CONTRIBUTING.md");
  int named = 0;
  for (std::sregex_iterator it(page.begin(), page.end(), kNamed), end; it != end; ++it, ++named)
    EXPECT_TRUE(std::filesystem::exists(kSource / (*it)[1].str())) << "CONTRIBUTING.md names " << (*it)[1];
  EXPECT_GT(named, 30);
}

}  // namespace
}  // namespace palpate::test
