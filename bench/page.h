#pragma once

#include <filesystem>
#include <string>

namespace palpate::bench {

/// The page with everything between its two markers replaced. Throws BadInput where it has not both of them.
void write_between(const std::filesystem::path& page, const std::string& begin, const std::string& end,
                   const std::string& text);

}  // namespace palpate::bench
