#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

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

/// As GitHub and mkdocs make it of a heading.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading)
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-')
      anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (c == ' ')
      anchor += '-';
  return anchor;
}

std::set<std::string> anchors_of(const std::string& page) {
  static const std::regex kHeading(R"((?:^|\n)#+ ([^\n]+))");
  std::set<std::string> anchors;
  for (std::sregex_iterator it(page.begin(), page.end(), kHeading), end; it != end; ++it)
    anchors.insert(anchor_of((*it)[1]));
  return anchors;
}

TEST(Pages, EveryLinkBetweenThemLeadsSomewhere) {
  static const std::regex kLink(R"(\]\(([^)#:\s]*)(#[^)\s]+)?\))");
  std::vector<std::filesystem::path> pages = {kSource / "README.md", kSource / "CONTRIBUTING.md",
                                              kSource / "CHANGELOG.md"};
  for (const auto& entry : std::filesystem::directory_iterator(kSource / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  int links = 0;
  for (const std::filesystem::path& page : pages) {
    const std::string text = read_file(page);
    for (std::sregex_iterator it(text.begin(), text.end(), kLink), end; it != end; ++it, ++links) {
      const std::string file = (*it)[1], anchor = (*it)[2];
      const std::filesystem::path target = file.empty() ? page : page.parent_path() / file;
      ASSERT_TRUE(std::filesystem::exists(target)) << page << " leads to " << file;
      if (!anchor.empty() && target.extension() == ".md") {
        EXPECT_TRUE(anchors_of(read_file(target)).count(anchor.substr(1))) << page << " leads to " << file << anchor;
      }
    }
  }
  EXPECT_GT(links, 60);
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
