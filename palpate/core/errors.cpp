#include "palpate/core/errors.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace palpate {

std::string obstacle_to_reading(const std::filesystem::path& file) {
  std::error_code ignored;
  const auto kind = std::filesystem::status(file, ignored).type();
  if (kind == std::filesystem::file_type::directory) return "is a folder";
  if (kind == std::filesystem::file_type::not_found) return "does not exist";
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return fmt::format("cannot be opened ({})", std::strerror(errno));
  if (stream.peek() == std::ifstream::traits_type::eof()) return "is empty";
  return {};
}

}  // namespace palpate
