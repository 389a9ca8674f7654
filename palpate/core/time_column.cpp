#include "palpate/core/time_column.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <regex>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/core/units.h"

namespace palpate {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kHour_s = 3600, kDay_s = 86400;

/// Time of day of one cell, and after how long it begins anew.
struct Clock {
  double time_s = kNone;
  double period_s = kDay_s;
  bool is_unclear = false;  ///< a colon after the seconds, and not the three digits of ms (or six, or nine) behind it
};

Clock clock_of(const std::string& text) {
  static const std::regex kTime(R"((?:^|[ T/])(\d{1,2}):(\d{2})(?::(\d{1,2}))?(?:([.,:])(\d+))?\s*([aApP][mM])?)");
  constexpr size_t kLongest = 64;  // no time is longer, and the search would take the stack for what is
  std::smatch found;
  if (text.size() > kLongest || !std::regex_search(text, found, kTime)) return {};
  const double first = std::stod(found[1]), second = std::stod(found[2]);
  const double fraction = found[5].length() ? std::stod("0." + found[5].str()) : 0;
  if (!found[3].length()) {
    if (!found[5].length()) return {};  // hours and minutes tell no force from the next
    return {60 * first + second + fraction, kHour_s};
  }
  if (found[4].str() == ":" && found[5].length() % 3 != 0) return {.is_unclear = true};
  double hours = first;
  if (found[6].length()) hours = std::fmod(hours, 12) + (std::tolower(found[6].str()[0]) == 'p' ? 12 : 0);
  return {kHour_s * hours + 60 * second + std::stod(found[3]) + fraction, kDay_s};
}

std::vector<double> times_of_day(const Table& table) {
  std::vector<double> times;
  double before = kNone, begun_anew_s = 0;
  for (const Table::Row& row : table.rows()) {
    const Clock clock = clock_of(table.text(row, "time_s"));
    if (clock.is_unclear)
      throw BadInput(fmt::format(
          "{}:{}: time_s is '{}', expected a time of day with three digits of ms after the last colon, or a point; {}",
          table.file().string(), row.line, table.text(row, "time_s"), table.header_found()));
    if (clock.time_s < before - 0.5 * clock.period_s) begun_anew_s += clock.period_s;
    if (!std::isnan(clock.time_s)) before = clock.time_s;
    times.push_back(clock.time_s + begun_anew_s);
  }
  return times;
}

/// Rows one after the other with the same stamp.
struct Run {
  size_t begin = 0, count = 0;
};

/// Of the rows with a time.
std::vector<Run> runs_of(const std::vector<double>& times, const std::vector<size_t>& rows) {
  std::vector<Run> runs;
  for (size_t i = 0; i < rows.size(); ++i)
    if (runs.empty() || times[rows[i]] != times[rows[runs.back().begin]])
      runs.push_back({i, 1});
    else
      ++runs.back().count;
  return runs;
}

/// A logger of many rows in a second that writes whole seconds: its rows lie evenly within them. Throws BadInput where
/// the seconds hold different numbers of rows.
std::vector<double> spread_over_seconds(const Table& table, std::vector<double> times) {
  constexpr size_t kMinRuns = 3;  // the first and the last may be cut off
  constexpr double kMinRows = 3;  // two of one stamp are one moment that was read twice
  constexpr double kRegular = 0.1, kRegularRows = 1;
  std::vector<size_t> rows;
  for (size_t i = 0; i < times.size(); ++i)
    if (std::isfinite(times[i])) rows.push_back(i);
  const bool are_whole =
      std::all_of(rows.begin(), rows.end(), [&](size_t i) { return times[i] == std::floor(times[i]); });
  const std::vector<Run> runs = runs_of(times, rows);
  if (!are_whole || runs.size() < kMinRuns) return times;
  std::vector<double> counts, steps;
  for (size_t i = 1; i + 1 < runs.size(); ++i) {
    counts.push_back(static_cast<double>(runs[i].count));
    steps.push_back(times[rows[runs[i].begin]] - times[rows[runs[i - 1].begin]]);
  }
  const double usual = median_of(counts);
  if (usual < kMinRows || median_of(steps) != 1) return times;
  for (size_t i = 0; i < runs.size(); ++i) {
    const auto count = static_cast<double>(runs[i].count);
    const bool is_cut = (i == 0 || i + 1 == runs.size()) && count < usual;
    const Table::Row& first = table.rows()[rows[runs[i].begin]];
    if (!is_cut && std::abs(count - usual) > kRegularRows + kRegular * usual)
      throw BadInput(fmt::format(
          "{}:{}: time_s is '{}' on {} rows where other seconds have {}, expected a fraction of the second, "
          "or as many rows in each; {}",
          table.file().string(), first.line, table.text(first, "time_s"), count, usual, table.header_found()));
    const double of_second = is_cut ? usual : count, missing = is_cut && i == 0 ? usual - count : 0;
    for (size_t k = 0; k < runs[i].count; ++k)
      times[rows[runs[i].begin + k]] += (missing + static_cast<double>(k)) / of_second;
  }
  return times;
}

/// First, last and median step of the numbers that are there.
struct Extent {
  double first = kNone, last = kNone, step = 0;
};

Extent extent_of(const std::vector<double>& times) {
  Extent extent;
  std::vector<double> steps;
  for (const double time : times) {
    if (std::isnan(time)) continue;
    if (std::isnan(extent.first)) extent.first = time;
    if (time > extent.last) steps.push_back(time - extent.last);
    extent.last = time;
  }
  if (!steps.empty()) {
    extent.step = median_of(steps);
  }
  return extent;
}

/// Of the units that make the steps credible and the rows long enough, the one by which the rows last most nearly as
/// long as what they belong to.
double seconds_per_unit(const Table& table, const Extent& extent, const TimeHints& hints) {
  const double length = extent.last - extent.first;
  std::optional<double> best;
  double best_distance = std::numeric_limits<double>::infinity();
  for (const double unit : {1.0, 1e-3, 1e-6, 1e-9}) {
    const double step_s = extent.step * unit, length_s = length * unit;
    if (step_s > hints.longest_step_s || step_s < hints.shortest_step_s || length_s < 0.5 * hints.span_s) continue;
    const double distance = hints.span_s > 0 ? std::abs(std::log(length_s / hints.span_s)) : 0;
    if (distance >= best_distance) continue;
    best = unit;
    best_distance = distance;
  }
  if (best) return *best;
  const std::string wanted = hints.span_s > 0 ? fmt::format(" and at least half of {:g} s long", hints.span_s) : "";
  throw BadInput(
      fmt::format("{}: the time goes from {:.15g} to {:.15g} in steps of {:g}, which is neither in seconds nor in ms, "
                  "us or ns a log "
                  "with {:g} to {:g} s between rows{}; {}",
                  table.file().string(), extent.first, extent.last, extent.step, hints.shortest_step_s,
                  hints.longest_step_s, wanted, table.header_found()));
}

/// Of the coarser units than the stated one, the first by which the rows are as long as they should be; "" where none
/// is.
std::string unit_that_fits(const Extent& extent, const Unit& stated, const TimeHints& hints) {
  for (const auto& [name, factor] : {std::pair{"s", 1.0}, std::pair{"ms", 1e-3}, std::pair{"us", 1e-6}}) {
    const double step_s = extent.step * factor / stated.factor;
    const double length_s = (extent.last - extent.first) * factor / stated.factor;
    if (factor > stated.factor && length_s >= 0.5 * hints.span_s && step_s <= hints.longest_step_s) return name;
  }
  return "";
}

}  // namespace

std::vector<TableColumn> time_columns() {
  return {{"time_s",
           {"header.stamp", "stamp", "timestamp", "time", "t", "elapsedtime", "elapsed", "seconds", "sec", "timeofday",
            "datetime", "clock", "rosbagtimestamp", "xvalue", "zeit", "temps"}},
          {"stamp.secs", {"stamp.sec", "secs", "sec"}},
          {"stamp.nsecs", {"stamp.nanosec", "nsecs", "nanosec"}}};
}

std::vector<double> times_s(const Table& table, const TimeHints& hints) {
  std::vector<double> times;
  if (table.has("stamp.secs") && table.has("stamp.nsecs")) {
    for (const Table::Row& row : table.rows())
      times.push_back(table.number(row, "stamp.secs") + 1e-9 * table.number(row, "stamp.nsecs"));
    return times;
  }
  table.require({"time_s"});
  for (const Table::Row& row : table.rows()) times.push_back(table.number(row, "time_s"));
  const bool none = std::all_of(times.begin(), times.end(), [](double time) { return std::isnan(time); });
  if (none && !table.rows().empty()) return spread_over_seconds(table, times_of_day(table));
  const std::optional<Unit> stated = unit_of(table.stated_unit("time_s"));
  if (stated && stated->kind == Unit::Kind::time) times = spread_over_seconds(table, times);
  const Extent extent = extent_of(times);
  if (!(extent.step > 0)) return times;
  if (stated && stated->kind == Unit::Kind::time) {
    const double length_s = extent.last - extent.first;
    if (const auto fitting = unit_that_fits(extent, *stated, hints); length_s < 0.1 * hints.span_s && !fitting.empty())
      throw BadInput(fmt::format(
          "{}: column time goes from {:.15g} to {:.15g}, in {} as the header says {:g} s of log for {:g} s of video; "
          "in {} it would fit: expected the unit that the numbers are in; {}",
          table.file().string(), extent.first / stated->factor, extent.last / stated->factor,
          table.stated_unit("time_s"), length_s, hints.span_s, fitting, table.header_found()));
    if (hints.span_s > 0 && extent.step > 0.1 * hints.span_s)
      throw BadInput(fmt::format(
          "{}: rows are {:g} s apart by their time, too far for {:g} s of video; is column time in {}? {}",
          table.file().string(), extent.step, hints.span_s, table.stated_unit("time_s"), table.header_found()));
    return times;
  }
  const double unit = seconds_per_unit(table, extent, hints);
  for (double& time : times) time *= unit;
  return times;
}

}  // namespace palpate
