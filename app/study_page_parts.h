#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace palpate::app {

/// The page of a study around its data; script and style are inside.
std::string study_page_html(const nlohmann::ordered_json& data);

/// A file of a type such as video/mp4 as text that a page can hold; empty where there is none.
std::string data_uri(const std::filesystem::path& file, const std::string& type);

/// Throws Unfinished.
void write_file(const std::filesystem::path& file, const std::string& text);

}  // namespace palpate::app
