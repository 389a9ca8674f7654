#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "fuzz/targets.h"

namespace palpate::fuzz {
namespace {

const std::filesystem::path kCorpus = std::filesystem::path(PALPATE_SOURCE_DIR) / "fuzz/corpus";

std::vector<std::pair<std::string, std::string>> files_of(const Target& target) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& entry : std::filesystem::directory_iterator(kCorpus / target.name)) {
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files.emplace_back(entry.path().filename().string(), bytes.str());
  }
  return files;
}

class Corpus : public ::testing::TestWithParam<std::string> {
 protected:
  const Target& target() const { return target_called(GetParam()); }
};

/// A file of the corpus that is refused covers the first lines of its reader only. What fuzzing once broke a reader
/// with is called broken_...
TEST_P(Corpus, IsReadToTheEnd) {
  for (const auto& [name, bytes] : files_of(target()))
    EXPECT_EQ(target().read(bytes).has_value(), !name.starts_with("broken_")) << GetParam() << "/" << name;
}

TEST_P(Corpus, CutAnywhereIsReadOrRefused) {
  constexpr size_t kCuts = 120;
  for (const auto& [name, bytes] : files_of(target()))
    for (size_t cut = 0; cut < kCuts; ++cut)
      EXPECT_NO_THROW(target().read(std::string_view(bytes).substr(0, bytes.size() * cut / kCuts)))
          << GetParam() << "/" << name << " cut after " << bytes.size() * cut / kCuts << " bytes";
}

TEST_P(Corpus, WithWrongBytesIsReadOrRefused) {
  constexpr int kTrials = 60;
  std::mt19937 random(1);
  for (const auto& [name, bytes] : files_of(target()))
    for (int trial = 0; trial < kTrials; ++trial) {
      std::string wrong = bytes;
      for (int i = 0; i < 1 + trial % 8; ++i) wrong[random() % wrong.size()] = static_cast<char>(random() % 256);
      EXPECT_NO_THROW(target().read(wrong)) << GetParam() << "/" << name << ", trial " << trial;
    }
}

TEST_P(Corpus, APlantedBugIsFoundWithinAMinute) {
  const char* fuzzer = std::getenv("PALPATE_FUZZER");
  if (!fuzzer) GTEST_SKIP() << "PALPATE_FUZZER does not name a fuzz_readers (./dev sanitize builds it where clang is)";
  const std::string scratch = "/dev/shm/palpate_planted_" + GetParam();
  std::filesystem::remove_all(scratch);
  std::filesystem::create_directories(scratch);
  const std::string command = fmt::format(
      "PALPATE_FUZZ={0} PALPATE_FUZZ_PLANTED={1} {2} -max_total_time=60 -artifact_prefix={3}/ {3} {1} >{3}/log 2>&1",
      GetParam(), (kCorpus / GetParam()).string(), fuzzer, scratch);
  EXPECT_NE(std::system(command.c_str()), 0)
      << GetParam() << ": a file that is read and says something new is not found";
  std::filesystem::remove_all(scratch);
}

std::vector<std::string> names() {
  std::vector<std::string> names;
  for (const Target& target : targets()) names.push_back(target.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Readers, Corpus, ::testing::ValuesIn(names()),
                         [](const auto& target) { return target.param; });

}  // namespace
}  // namespace palpate::fuzz
