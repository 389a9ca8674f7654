#include "palpate/stereo/times_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <regex>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/core/table_text.h"
#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

constexpr double kDay_s = 86400;
/// Between images of one camera.
constexpr double kLongestStep_s = 2, kShortestStep_s = 1e-3;

struct TimedName {
  double time = 0;
  std::string name;
};

/// Seconds since the first day of some month where a date stands before it, which is enough to tell one from the next.
std::optional<double> time_of_day_s(const std::string& text) {
  static const std::regex kTime(R"((?:(\d{4})-(\d{2})-(\d{2})[T ])?(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?))");
  constexpr size_t kLongest = 64;
  std::smatch found;
  if (text.size() > kLongest || !std::regex_search(text, found, kTime)) return std::nullopt;
  std::string seconds = found[6];
  std::replace(seconds.begin(), seconds.end(), ',', '.');
  const double day = found[3].matched ? std::stod(found[3]) : 0;
  return day * kDay_s + 3600 * std::stod(found[4]) + 60 * std::stod(found[5]) + number_of(seconds);
}

/// Lines without a time at their beginning are headers and comments.
std::vector<TimedName> lines_of(const std::filesystem::path& file, bool& is_clock) {
  std::istringstream stream(as_utf8(read_whole_file(file)));
  std::vector<TimedName> lines;
  is_clock = false;
  for (std::string line; std::getline(stream, line);) {
    line = std::string(trimmed(line));
    if (line.empty() || line.front() == '#') continue;
    if (const auto time = time_of_day_s(line)) {
      lines.push_back({*time, ""});
      is_clock = true;
      continue;
    }
    const size_t end = line.find_first_of(" \t,;");
    const double time = number_of(unquoted(line.substr(0, end)));
    if (std::isnan(time)) continue;
    const size_t begin = line.find_first_not_of(" \t,;", end);
    lines.push_back({time, begin == std::string::npos ? "" : unquoted(line.substr(begin))});
  }
  return lines;
}

double seconds_per_unit(const std::filesystem::path& file, const std::vector<TimedName>& lines) {
  if (lines.size() < 2) return 1;
  std::vector<double> steps;
  for (size_t i = 1; i < lines.size(); ++i) steps.push_back(lines[i].time - lines[i - 1].time);
  if (std::all_of(steps.begin(), steps.end(), [](double step) { return step == 1; }))
    throw BadInput(fmt::format("{}: its first column counts frames, expected their times", file.string()));
  const double step = median_of(steps);
  for (const double unit : {1.0, 1e-3, 1e-6, 1e-9})
    if (step * unit >= kShortestStep_s && step * unit <= kLongestStep_s) return unit;
  throw BadInput(fmt::format("{}: its times are {:g} apart, expected {:g} to {:g} s in s, ms, us or ns", file.string(),
                             step, kShortestStep_s, kLongestStep_s));
}

}  // namespace

std::vector<double> read_image_times(const std::filesystem::path& file, const std::vector<NumberedFile>& images) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected the times of the images", file.string(), obstacle));
  bool is_clock = false;
  const std::vector<TimedName> lines = lines_of(file, is_clock);
  const double unit = is_clock ? 1 : seconds_per_unit(file, lines);
  std::map<std::string, double> by_name;
  for (const TimedName& line : lines)
    if (!line.name.empty()) by_name.emplace(std::filesystem::path(line.name).stem().string(), line.time * unit);
  const auto last = images.empty() ? 0 : images.back().number;
  const auto count = static_cast<long long>(lines.size());
  std::vector<double> times;
  for (size_t i = 0; i < images.size(); ++i) {
    const auto named = by_name.find(images[i].file.stem().string());
    const long long number = images[i].number;
    if (named != by_name.end())
      times.push_back(named->second);
    else if (lines.size() == images.size())
      times.push_back(lines[i].time * unit);
    else if (last < count || last == count)  // numbers count from 0 or from 1
      times.push_back(lines[static_cast<size_t>(std::max(0LL, last < count ? number : number - 1))].time * unit);
    else
      throw BadInput(fmt::format("{} holds {} times, expected one for each of the {} images", file.string(), count,
                                 images.size()));
    if (i > 0 && !(times[i] > times[i - 1]))
      throw BadInput(fmt::format("{}: the time of {} is not after that of the image before it", file.string(),
                                 images[i].file.filename().string()));
  }
  return times;
}

ImageTimes times_beside(const std::vector<NumberedFile>& images) {
  const std::filesystem::path folder = images.front().file.parent_path();
  for (const std::filesystem::path& place : {folder, folder.parent_path()})
    for (const char* name : {"times.txt", "timestamps.txt", "timestamps.csv", "times.csv", "data.csv", "rgb.txt"}) {
      const std::filesystem::path file = place / name;
      std::error_code ignored;
      if (!std::filesystem::is_regular_file(file, ignored)) continue;
      try {
        return {read_image_times(file, images), "times of the images from " + file.string()};
      } catch (const BadInput& reason) {
        return {{}, fmt::format("not used: {}", reason.what())};
      }
    }
  return {};
}

}  // namespace palpate
