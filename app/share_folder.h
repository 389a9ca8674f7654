#pragma once

#include <filesystem>

namespace palpate::app {

/// share/palpate beside the program, wherever the two are moved: bin/palpate and share/palpate.
std::filesystem::path share_folder();

}  // namespace palpate::app
