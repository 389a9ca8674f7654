#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::fuzz {

/// One reader, given any bytes in place of its file.
struct Target {
  std::string name;    ///< also of its folder in fuzz/corpus
  std::string ending;  ///< of the files that it reads
  /// A figure of what was read; nothing where it was refused with BadInput. Whatever else happens is a finding.
  std::optional<double> (*read)(std::string_view bytes);
};

/// Every reader of files that users bring.
const std::vector<Target>& targets();

/// Throws std::invalid_argument that names those that there are.
const Target& target_called(const std::string& name);

}  // namespace palpate::fuzz
