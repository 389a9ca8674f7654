#include "palpate/session/output_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "palpate/core/errors.h"

namespace palpate {

void require_output_folder(const std::filesystem::path& folder) {
  if (folder.empty()) throw BadInput("the output folder is '', expected a name");
  const auto refuse = [&folder](const std::string& reason) {
    throw BadInput(fmt::format("results cannot be written into {} ({}), expected a folder or a name for a new one",
                               folder.string(), reason));
  };
  // Only trying tells: access rights promise too much to root and in /proc.
  std::error_code error;
  std::vector<std::filesystem::path> made;
  const std::filesystem::path wanted = std::filesystem::absolute(folder).lexically_normal();
  for (auto path = wanted; !std::filesystem::exists(path, error) && path.has_relative_path(); path = path.parent_path())
    made.push_back(path);
  std::filesystem::create_directories(wanted, error);
  if (error || !std::filesystem::is_directory(wanted, error)) refuse(error ? error.message() : "it is a file");
  std::string trial = (wanted / ".palpate_XXXXXX").string();
  const bool writable = mkdtemp(trial.data()) != nullptr;
  const std::string reason = std::strerror(errno);
  if (writable) std::filesystem::remove(trial, error);
  for (const std::filesystem::path& path : made) std::filesystem::remove(path, error);
  if (!writable) refuse(reason);
}

}  // namespace palpate
