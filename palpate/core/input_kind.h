#pragma once

#include <string>
#include <vector>

namespace palpate {

/// One kind of file that a reader takes, as docs/inputs.md says it.
struct InputKind {
  std::string kind;
  std::string written_by;
  std::string how;  ///< what of it is read, and what is converted
};

/// A table, with a time column where it has one (core/table.h).
std::vector<InputKind> table_kinds();

}  // namespace palpate
