#pragma once

#include <string>
#include <vector>

namespace palpate {

/// One change to a YAML text: `path` leads through keys and, in lists, numbers from 0 ("+" = one more item).
struct YamlChange {
  std::vector<std::string> path;
  std::string value;  ///< YAML on one line; empty = the key or item is taken away
};

/// The text with its changes, one after the other. All else stays as it is written, comments too; groups that are
/// missing are made. Throws BadInput where the place cannot be changed by itself (an alias, more than one line of plain
/// text) or where the value is not YAML.
std::string with_changes(const std::string& text, const std::vector<YamlChange>& changes);

}  // namespace palpate
