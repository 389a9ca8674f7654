#pragma once

#include <filesystem>
#include <string>

namespace palpate::study {

/// A Markdown page (tables, pictures, clips) as one HTML page that needs no network: what it shows is inside. Paths
/// start at `folder`.
std::string html_page(const std::string& markdown, const std::filesystem::path& folder);

}  // namespace palpate::study
