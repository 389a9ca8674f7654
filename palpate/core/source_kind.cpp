#include "palpate/core/source_kind.h"

namespace palpate {

SourceKind kind_of_source(const std::string& name) {
  if (name.find(" ! ") != std::string::npos) return SourceKind::pipeline;
  if (name.find("://") != std::string::npos) return SourceKind::address;
  const bool is_number = !name.empty() && name.find_first_not_of("0123456789") == std::string::npos;
  return is_number || name.starts_with("/dev/video") ? SourceKind::device : SourceKind::file;
}

}  // namespace palpate
