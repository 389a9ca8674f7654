#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>

namespace palpate {

/// A whole YAML file, as read_settings_file reads it. Throws BadInput when it is missing or not YAML.
YAML::Node load_settings_file(const std::filesystem::path& file);

}  // namespace palpate
