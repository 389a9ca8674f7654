#include "bench/page.h"

#include <fmt/format.h>

#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"

namespace palpate::bench {

void write_between(const std::filesystem::path& page, const std::string& begin, const std::string& end,
                   const std::string& text) {
  const std::string whole = read_whole_file(page);
  const size_t from = whole.find(begin), to = whole.find(end);
  if (from == std::string::npos || to == std::string::npos)
    throw BadInput(fmt::format("{} has no place for the tables", page.string()));
  write_whole_file(page, whole.substr(0, from + begin.size()) + "\n" + text + "\n" + whole.substr(to));
}

}  // namespace palpate::bench
