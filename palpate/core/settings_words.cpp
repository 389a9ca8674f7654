#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "palpate/core/errors.h"
#include "palpate/core/settings.h"

namespace palpate {

namespace {

size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t min = std::max<size_t>(2, word.size() / 2);
  for (const std::string& candidate : candidates) {
    const size_t distance = edit_distance(word, candidate);
    if (distance < min || (distance == min && nearest.empty())) {
      min = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string expand_environment(const std::string& text) {
  std::string expanded;
  for (size_t i = 0; i < text.size();) {
    const size_t end = text.compare(i, 2, "${") == 0 ? text.find('}', i) : std::string::npos;
    if (end == std::string::npos) {
      expanded += text[i++];
      continue;
    }
    const std::string name = text.substr(i + 2, end - i - 2);
    const char* value = std::getenv(name.c_str());
    if (!value)
      throw BadInput(fmt::format("the environment variable {} is not set, expected the folder it stands for", name));
    expanded += value;
    i = end + 1;
  }
  return expanded;
}

}  // namespace palpate
