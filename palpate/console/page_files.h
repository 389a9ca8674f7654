#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace palpate {

struct PageFile {
  std::string type;
  std::string bytes;
};

/// The built page: what is asked for ("/", "/assets/x.js") -> the file. Read once, so that no request ever names a
/// file.
using PageFiles = std::map<std::string, PageFile>;

/// Empty where the page was not built.
PageFiles read_page_files(const std::filesystem::path& folder);

}  // namespace palpate
