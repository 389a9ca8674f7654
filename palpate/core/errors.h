#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace palpate {

/// The input cannot be used; one clear sentence that names the file, the key, the value and what was expected.
/// The program ends with exit code 3.
struct BadInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The work stopped half-way through no fault of the settings (a truncated video, a full disk); what was done so far is
/// kept. The program ends with exit code 4.
struct Unfinished : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What stands between us and the content of a file, as the end of a sentence: "does not exist", "is a folder", "is
/// empty", "cannot be opened (Permission denied)"; "" = nothing.
std::string obstacle_to_reading(const std::filesystem::path& file);

}  // namespace palpate
