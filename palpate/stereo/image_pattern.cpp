#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <regex>

#include "palpate/stereo/frame_source.h"

namespace palpate {

namespace {

/// "%04d", or "%%", which is a percent sign.
const std::regex& conversion() {
  static const std::regex kConversion("%%|%0?([0-9]{0,2})[diu]");
  return kConversion;
}

std::vector<std::smatch> placeholders_of(const std::string& text) {
  std::vector<std::smatch> found;
  for (std::sregex_iterator next(text.begin(), text.end(), conversion()), end; next != end; ++next)
    if (next->str() != "%%") found.push_back(*next);
  return found;
}

size_t width_of(const std::smatch& placeholder) {
  return placeholder[1].length() > 0 ? std::stoul(placeholder[1]) : 0;
}

/// "%04d" replaced by the number, "%%" by a percent sign.
std::string with_number(const std::string& text, long long number) {
  std::string result;
  auto rest = text.begin();
  for (std::sregex_iterator next(text.begin(), text.end(), conversion()), end; next != end; ++next) {
    result.append(rest, (*next)[0].first);
    std::string shown = next->str() == "%%" ? "%" : std::to_string(number);
    if (const size_t width = width_of(*next); shown.size() < width) shown.insert(0, width - shown.size(), '0');
    result += shown;
    rest = (*next)[0].second;
  }
  return result.append(rest, text.end());
}

std::string without_number(const std::string& text) {
  return with_number(text, 0);
}

std::vector<NumberedFile> files_named_like(const std::filesystem::path& pattern) {
  std::filesystem::path folder, rest;
  std::string numbered;
  for (const std::filesystem::path& part : pattern) {
    if (!numbered.empty())
      rest /= part;
    else if (has_placeholder(part))
      numbered = part.string();
    else
      folder /= without_number(part.string());
  }
  const std::vector<std::smatch> found = placeholders_of(numbered);
  if (found.empty()) return {};
  const std::string before = without_number({numbered.cbegin(), found[0][0].first});
  const std::string after(found[0][0].second, numbered.cend());
  const size_t width = std::max<size_t>(1, width_of(found[0]));
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

}  // namespace

bool has_placeholder(const std::filesystem::path& pattern) {
  return !placeholders_of(pattern.string()).empty();
}

std::vector<NumberedFile> files_of_pattern(const std::filesystem::path& pattern) {
  const std::string text = pattern.string();
  const std::vector<std::smatch> found = placeholders_of(text);
  // What looks like a number may be meant as it stands: 100%done/left_%02d.png.
  constexpr size_t kMost = 4;
  const unsigned readings = 1U << std::min(found.size(), kMost);
  for (unsigned as_it_stands = 0; as_it_stands + 1 < readings; ++as_it_stands) {
    std::string reading = text;
    for (size_t i = std::min(found.size(), kMost); i-- > 0;)
      if ((as_it_stands >> i & 1U) != 0) reading.insert(static_cast<size_t>(found[i].position()), "%");
    std::vector<NumberedFile> files = files_named_like(reading);
    if (!files.empty()) return files;
  }
  return {};
}

}  // namespace palpate
