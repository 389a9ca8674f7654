#include "study/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "study/results.h"

namespace palpate::study {

namespace {

using Json = nlohmann::ordered_json;

/// Of a sweep; what nobody measured in it is left out.
const std::vector<std::pair<const char*, const char*>> kSweepColumns = {
    {"force_nrmse_pct", "force error, %"},
    {"gain", "force gain"},
    {"direction_error_deg_median", "direction, °"},
    {"peak_force_N", "peak, N"},
    {"true_peak_N", "true peak, N"},
    {"elements", "elements"},
    {"coverage_pct", "depth measured, %"},
    {"map_s", "map, s"},
    {"median_frame_ms", "frame, ms"},
    {"stage_track_ms", "instrument, ms"},
    {"stage_solve_ms", "equilibrium, ms"},
    {"stage_draw_ms", "overlay, ms"},
    {"frames_per_second", "frames per second"},
    {"statuses", "frames"},
};

/// Tables about other things leave out where the time of a frame goes.
bool is_of_time(const std::string& column) {
  return column.starts_with("stage_") || column == "frames_per_second";
}

std::string text(const Json& value) {
  return value.is_string() ? value.get<std::string>() : "";
}

std::string cell(std::string words) {
  for (size_t at = 0; (at = words.find('|', at)) != std::string::npos; at += 2) words.replace(at, 1, "\\|");
  return words;
}

bool is_met(const Json& value, double goal) {
  return value.is_number() && std::abs(value.get<double>()) <= goal;
}

struct Goals {
  int met = 0, all = 0;
  std::string missed;
};

Goals goals_of(const Json& experiment, const Json& columns) {
  Goals goals;
  for (const Json& run : experiment["runs"])
    for (const Json& column : columns) {
      const std::string name = column["name"];
      if (run["status"] != "done" || !experiment["goals"].contains(name)) continue;
      const double goal = experiment["goals"][name];
      ++goals.all;
      if (is_met(run["figures"][name], goal))
        ++goals.met;
      else
        goals.missed += fmt::format("{}{} {}, goal {:g}", goals.missed.empty() ? "" : "; ", text(column["title"]),
                                    short_number(run["figures"][name]), goal);
    }
  return goals;
}

/// Every figure of one run below the other, with its goal.
std::string goal_table(const Json& experiment, const Json& run, const Json& columns) {
  std::string table = "| figure | goal | measured |\n|---|---|---|\n";
  for (const Json& column : columns) {
    const std::string name = column["name"];
    const Json& value = run["figures"][name];
    const bool has_goal = experiment["goals"].contains(name);
    if ((value.is_null() || is_of_time(name)) && !has_goal) continue;
    const double goal = has_goal ? experiment["goals"][name].get<double>() : 0;
    table += fmt::format("| {} | {} | {} |\n", text(column["title"]), has_goal ? fmt::format("≤ {:g}", goal) : "",
                         !has_goal             ? short_number(value)
                         : is_met(value, goal) ? short_number(value)
                                               : "**" + short_number(value) + "**");
  }
  return table;
}

std::string warnings_text(const Json& run) {
  std::string names;
  for (const auto& [name, frames] : run["warnings"].items())
    names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", name, frames.get<int>());
  return names;
}

std::string sweep_table(const Json& experiment) {
  std::vector<std::pair<const char*, const char*>> shown;
  const bool about_time = experiment["key"] == "map.elements";
  for (const auto& column : kSweepColumns)
    for (const Json& run : experiment["runs"])
      if (!run["figures"][column.first].is_null() && (about_time || !is_of_time(column.first))) {
        shown.push_back(column);
        break;
      }
  const std::string unit = text(experiment["unit"]);
  std::string table = "| `" + text(experiment["key"]) + "`" + (unit.empty() ? "" : ", " + unit) + " |", rule = "|---|";
  for (const auto& [name, title] : shown) {
    table += fmt::format(" {} |", title);
    rule += "---|";
  }
  table += " warnings (frames) |\n" + rule + "---|\n";
  for (const Json& run : experiment["runs"]) {
    table += "| " + cell(text(run["label"])) + " |";
    if (run["status"] != "done") {
      table += " " + cell(text(run["status"]) + ": " + text(run["reason"])) + " |\n";
      continue;
    }
    for (const auto& [name, title] : shown) table += " " + short_number(run["figures"][name]) + " |";
    table += " " + warnings_text(run) + " |\n";
  }
  return table;
}

std::string section(const Json& experiment, const Json& columns, bool with_clips) {
  std::string words = "## " + text(experiment["title"]) + "\n\n`" + text(experiment["name"]) + "`";
  if (!text(experiment["paper"]).empty()) words += " · paper: " + text(experiment["paper"]);
  words += "\n";
  if (!text(experiment["says"]).empty()) words += "\n" + text(experiment["says"]) + "\n";
  if (!text(experiment["findings"]).empty()) words += "\n**Measured.** " + text(experiment["findings"]) + "\n";
  const Goals goals = goals_of(experiment, columns);
  if (goals.all > 0)
    words += fmt::format("\n**Goals.** {} of {} met{}.\n", goals.met, goals.all,
                         goals.missed.empty() ? "" : "; not: " + goals.missed);
  if (!text(experiment["why"]).empty()) words += "\n**Why.** " + text(experiment["why"]) + "\n";
  for (const Json& picture : experiment["pictures"])
    words += fmt::format("\n![{}]({})\n", text(picture["caption"]), text(picture["file"]));
  if (with_clips && experiment.contains("clip")) words += fmt::format("\n![Overlay]({})\n", text(experiment["clip"]));
  const Json& runs = experiment["runs"];
  const bool single = runs.size() == 1 && runs[0]["status"] == "done" && text(experiment["key"]).empty();
  return words + "\n" + (single ? goal_table(experiment, runs[0], columns) : sweep_table(experiment)) + "\n";
}

std::string glance_table(const Json& page) {
  std::string table = "| experiment | paper | force error | goals met | not met |\n|---|---|---|---|---|\n";
  for (const Json& experiment : page["experiments"]) {
    const Goals goals = goals_of(experiment, page["columns"]);
    if (goals.all == 0) continue;
    table += fmt::format("| {} | {} | {} % | {} of {} | {} |\n", text(experiment["title"]), text(experiment["paper"]),
                         short_number(experiment["runs"][0]["figures"]["force_nrmse_pct"]), goals.met, goals.all,
                         goals.missed);
  }
  return table;
}

std::string ranking_table(const Json& ranking) {
  std::string table = "| setting | the force changes by | if it is wrong by | slope |\n|---|---|---|---|\n";
  for (const Json& row : ranking)
    table += fmt::format("| {} | {:+.1f} % | {} | {} |\n", text(row["title"]), row["effect_pct"].get<double>(),
                         text(row["uncertainty"]), text(row["slope"]));
  return table;
}

}  // namespace

std::string study_document(const Json& page, bool with_clips) {
  int done = 0, all = 0;
  for (const Json& experiment : page["experiments"])
    for (const Json& run : experiment["runs"]) {
      ++all;
      done += run["status"] == "done";
    }
  std::string words = "# " + text(page["title"]) + "\n\n" + text(page["about"]) + "\n\n" +
                      fmt::format(
                          "{} of {} runs are done. Errors are in % of the true peak force; times are those of the "
                          "machine that made this page.\n\n",
                          done, all);
  words += "## At a glance\n\n" + glance_table(page) + "\n";
  if (!page["ranking"].empty())
    words +=
        "## What matters most\n\nThe estimated force, when one setting is as wrong as it may well be and all else is "
        "known:\n\n" +
        ranking_table(page["ranking"]) + "\n";
  for (const Json& experiment : page["experiments"]) words += section(experiment, page["columns"], with_clips);
  return words + "Research software, not a medical device. Forces are proportional to the stated modulus.\n";
}

}  // namespace palpate::study
