// libFuzzer's side: PALPATE_FUZZ names the reader. With PALPATE_FUZZ_PLANTED a bug is planted behind it: a file that it
// takes and that says something else than those of the corpus is a crash. A test sees that it is found.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "fuzz/targets.h"

namespace {

using palpate::fuzz::Target;

const Target& chosen_target() {
  const char* name = std::getenv("PALPATE_FUZZ");
  static const Target& kTarget = palpate::fuzz::target_called(name ? name : "");
  return kTarget;
}

std::set<double> figures_of(const std::filesystem::path& corpus) {
  std::set<double> figures;
  for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    if (const auto figure = chosen_target().read(bytes.str())) figures.insert(*figure);
  }
  return figures;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const char* const kPlantedBeside = std::getenv("PALPATE_FUZZ_PLANTED");
  static const std::set<double> kKnown = kPlantedBeside ? figures_of(kPlantedBeside) : std::set<double>{};
  const auto figure = chosen_target().read({reinterpret_cast<const char*>(data), size});
  if (kPlantedBeside && figure && !kKnown.count(*figure)) std::abort();
  return 0;
}
