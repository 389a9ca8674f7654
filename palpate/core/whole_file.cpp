#include "palpate/core/whole_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

#include "palpate/core/errors.h"

namespace palpate {

namespace {
constexpr std::uintmax_t kLeftForRows_bytes = 1 << 20;
/// Files up to this size may take of what is left for the rows.
constexpr std::size_t kSmallFile_bytes = 1 << 14;
}  // namespace

void require_room(const std::filesystem::path& file, std::uintmax_t bytes) {
  std::error_code error;
  const std::filesystem::space_info space =
      std::filesystem::space(std::filesystem::absolute(file).parent_path(), error);
  if (!error && space.available < bytes + kLeftForRows_bytes)
    throw Unfinished(fmt::format("{} cannot be written: the disk is full", file.string()));
}

std::string read_whole_file(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}

void write_whole_file(const std::filesystem::path& file, std::string_view bytes) {
  if (bytes.size() > kSmallFile_bytes) require_room(file, bytes.size());
  const std::filesystem::path unfinished = file.string() + ".part";
  const auto fail = [&](const std::string& reason) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw Unfinished(fmt::format("{} cannot be written: {}", file.string(), reason));
  };
  errno = 0;
  std::ofstream stream(unfinished, std::ios::binary | std::ios::trunc);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) fail(errno != 0 ? std::strerror(errno) : "the disk does not take it");
  std::error_code error;
  std::filesystem::rename(unfinished, file, error);
  if (error) fail(error.message());
}

}  // namespace palpate
