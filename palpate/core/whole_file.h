#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// Throws Unfinished where the disk of `file` has no room for so many bytes beside the mebibyte that is left for the
/// rows of forces.csv: what is large stops early, so that what matters goes on.
void require_room(const std::filesystem::path& file, std::uintmax_t bytes);

/// Every byte of a file; empty where it cannot be opened.
std::string read_whole_file(const std::filesystem::path& file);

/// Writes a file that has its name only when it is complete: nobody ever reads half of it. Throws Unfinished with its
/// name and the reason; nothing of it is left then.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace palpate
