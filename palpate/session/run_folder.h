#pragma once

#include <filesystem>
#include <string>

#include "palpate/session/snapshot.h"

namespace palpate {

/// folder/stem + ending, or with the first free number: folder/stem-2 + ending.
std::filesystem::path free_file(const std::filesystem::path& folder, const std::string& stem,
                                const std::string& ending);

/// marks.csv of a run: frame, time and text of each. Throws Unfinished.
void write_marks(const RunView& run);

}  // namespace palpate
