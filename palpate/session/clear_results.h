#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// The folder is there afterwards, and holds none of the files that `map`, `estimate` and `demo` write: what an earlier
/// run left never stands beside what this one writes. Other files stay. Throws BadInput where one of `sources`, which
/// the scene reads, is such a file; Unfinished.
void begin_results(const std::filesystem::path& folder, const std::vector<std::string>& sources);

/// The same for the files of `simulate`; its own input stays.
void begin_sequence(const std::filesystem::path& folder, const std::filesystem::path& input);

}  // namespace palpate
