#include "palpate/console/page_files.h"
#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

std::string type_of(const std::string& ending) {
  static const std::map<std::string, std::string> kTypes = {{".html", "text/html; charset=utf-8"},
                                                            {".js", "text/javascript; charset=utf-8"},
                                                            {".css", "text/css; charset=utf-8"},
                                                            {".svg", "image/svg+xml"},
                                                            {".json", "application/json"},
                                                            {".png", "image/png"},
                                                            {".woff2", "font/woff2"},
                                                            {".txt", "text/plain; charset=utf-8"}};
  const auto found = kTypes.find(ending);
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

}  // namespace

PageFiles read_page_files(const std::filesystem::path& folder) {
  PageFiles files;
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, error)) {
    if (!entry.is_regular_file()) continue;
    files["/" + entry.path().lexically_relative(folder).generic_string()] = {type_of(entry.path().extension().string()),
                                                                             read_whole_file(entry.path())};
  }
  if (const auto index = files.find("/index.html"); index != files.end()) files["/"] = index->second;
  return files;
}

}  // namespace palpate
