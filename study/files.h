#pragma once

#include <filesystem>
#include <string>

namespace palpate::study {

/// Throws Unfinished.
void write_file(const std::filesystem::path& file, const std::string& text);

/// A file of a type such as video/mp4 as text that a page can hold; empty where there is none.
std::string data_uri(const std::filesystem::path& file, const std::string& type);

}  // namespace palpate::study
