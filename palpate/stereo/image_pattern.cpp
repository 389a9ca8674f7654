#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <regex>

#include "palpate/stereo/frame_source.h"

namespace palpate {

namespace {

const std::regex& placeholder() {
  static const std::regex kPlaceholder("%(0?)([0-9]{0,2})[diu]");
  return kPlaceholder;
}

std::string without_doubled_percent(const std::string& text) {
  return std::regex_replace(text, std::regex("%%"), "%");
}

/// "%04d" replaced by the number.
std::string with_number(const std::string& text, long long number) {
  std::string result = text;
  std::smatch found;
  while (std::regex_search(result, found, placeholder())) {
    const size_t width = found[2].length() ? std::stoul(found[2]) : 0;
    std::string digits = std::to_string(number);
    if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
    result = found.prefix().str() + digits + found.suffix().str();
  }
  return without_doubled_percent(result);
}

}  // namespace

bool has_placeholder(const std::filesystem::path& pattern) {
  return std::regex_search(pattern.string(), placeholder());
}

std::vector<NumberedFile> files_of_pattern(const std::filesystem::path& pattern) {
  std::filesystem::path folder, rest;
  std::string numbered;
  for (const std::filesystem::path& part : pattern) {
    if (!numbered.empty())
      rest /= part;
    else if (has_placeholder(part))
      numbered = part.string();
    else
      folder /= without_doubled_percent(part.string());
  }
  std::smatch found;
  if (!std::regex_search(numbered, found, placeholder())) return {};
  const std::string before = without_doubled_percent(found.prefix()), after = found.suffix();
  const size_t width = found[2].length() ? std::stoul(found[2]) : 1;
  std::vector<NumberedFile> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(before)) continue;
    const size_t end = std::min(name.find_first_not_of("0123456789", before.size()), name.size());
    const std::string digits = name.substr(before.size(), end - before.size());
    NumberedFile file;
    const auto [last, error] = std::from_chars(digits.data(), digits.data() + digits.size(), file.number);
    if (digits.size() < width || error != std::errc() || last != digits.data() + digits.size()) continue;
    if (name.substr(end) != with_number(after, file.number)) continue;
    file.file = entry.path();
    if (!rest.empty()) file.file /= with_number(rest.string(), file.number);
    if (std::filesystem::exists(file.file, ignored)) files.push_back(file);
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return files;
}

}  // namespace palpate
