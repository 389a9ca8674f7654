#include "tests/support/reference_data.h"

#include <cstdlib>

namespace palpate::test {

std::filesystem::path reference_data() {
  if (const char* folder = std::getenv("PALPATE_REFERENCE_DATA")) return folder;
  return std::filesystem::path(PALPATE_SOURCE_DIR) / ".." / "shared" / "data";
}

}  // namespace palpate::test
