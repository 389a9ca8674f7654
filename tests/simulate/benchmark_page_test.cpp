#include <gtest/gtest.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "palpate/simulate/dejavu_files.h"
#include "palpate/simulate/gesture.h"

namespace palpate {
namespace {

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// The code of the first block of this language on docs/benchmark.md.
std::string snippet(const std::string& language) {
  const auto page = std::filesystem::path(__FILE__).parent_path() / "../../docs/benchmark.md";
  const std::string text = read_file(page), fence = "```" + language + "\n";
  const size_t start = text.find(fence);
  if (start == std::string::npos) return {};
  return text.substr(start + fence.size(), text.find("```", start + fence.size()) - start - fence.size());
}

TEST(BenchmarkPage, NamesTheColumnsThatAreWritten) {
  const auto file =
      std::filesystem::path(::testing::TempDir()) / ("palpate_truth_" + std::to_string(getpid()) + ".csv");
  write_truth(file, {});
  EXPECT_EQ(read_file(file), snippet("csv"));
  std::filesystem::remove(file);
}

TEST(BenchmarkPage, ShowsAGestureThatIsUnderstood) {
  const YAML::Node scene = YAML::Load(snippet("yaml"));
  SimulateOptions options;
  Settings settings;
  describe(settings, options);
  ASSERT_TRUE(scene["simulate"]);
  read_settings(scene["simulate"], {"benchmark.md", "/"}, settings, "simulate.");
  EXPECT_TRUE(is_push(options.gesture));
  EXPECT_TRUE(options.write.surface && options.write.depth && options.look.interlace);
  EXPECT_EQ(options.write.grip, SimulatedFiles::Grip::automatic);
  EXPECT_GT(options.breathing.motion_mm.norm(), 1);
}

}  // namespace
}  // namespace palpate
