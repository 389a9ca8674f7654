#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// What read_body does to a file beyond reading it, in sentences for the user: elements that it turns, nodes of higher
/// order and physical groups that it leaves out. Throws BadInput as read_body does.
std::vector<std::string> body_remarks(const std::filesystem::path& file);

}  // namespace palpate
