#pragma once

#include <filesystem>

namespace palpate {

/// Finds out, before any work, whether results can be written into `folder`, which need not exist; leaves nothing
/// behind. Throws BadInput.
void require_output_folder(const std::filesystem::path& folder);

}  // namespace palpate
