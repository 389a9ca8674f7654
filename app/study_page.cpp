#include "app/study_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/study_page_parts.h"
#include "app/study_run.h"
#include "palpate/core/errors.h"
#include "palpate/feedback/forces_file.h"

namespace palpate::app {

namespace {

using Json = nlohmann::ordered_json;

/// Figures of the comparison first, then those of the run.
const std::vector<std::pair<std::string, std::string>> kColumns = {
    {"force_nrmse_pct", "force error, % of the true peak"},
    {"gain", "force gain"},
    {"direction_error_deg_median", "direction, degrees"},
    {"force_correlation", "correlation"},
    {"onset_error_frames", "onset, frames"},
    {"release_error_frames", "release, frames"},
    {"false_contact_frames", "false contact, frames"},
    {"tip_rmse_mm", "tip, mm RMS"},
    {"true_peak_N", "true peak, N"},
    {"peak_force_N", "peak, N"},
    {"peak_force_per_modulus_N_per_kPa", "peak / E, N/kPa"},
    {"elements", "elements"},
    {"map_s", "map, s"},
    {"median_frame_ms", "frame, ms median"},
    {"p99_frame_ms", "frame, ms 99 %"},
};

Json figure(const Json& result, const std::string& name) {
  if (result.contains("comparison") && result["comparison"].contains(name)) return result["comparison"][name];
  return result.contains(name) ? result[name] : Json();
}

Json series_of(const std::filesystem::path& forces, const std::filesystem::path& truth) {
  Json series;
  const auto add = [&series](const std::string& name, const std::vector<ForceRow>& rows) {
    Json points = Json::array();
    for (const ForceRow& row : rows)
      points.push_back({{"x", row.time_s}, {"y", std::round(row.force_magnitude_N * 1e4) / 1e4}});
    series[name] = points;
  };
  try {
    add("estimate", read_forces(forces));
    if (!truth.empty()) add("truth", read_truth(truth));
  } catch (const BadInput&) {
    return series;
  }
  return series;
}

/// Slope of log(figure) over log(value): 1 where the figure is proportional to the value.
std::optional<double> logarithmic_slope(const std::vector<std::pair<double, double>>& points) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [value, figure] : points) {
    if (value <= 0 || figure <= 0) continue;
    const double a = std::log(value), b = std::log(figure);
    n += 1;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
  }
  const double spread = n * xx - x * x;
  return n >= 2 && spread > 1e-12 ? std::optional((n * xy - x * y) / spread) : std::nullopt;
}

/// What a sweep of numbers says in two sentences.
std::string findings_of(const StudyExperiment& experiment, const Json& runs) {
  std::vector<std::pair<double, double>> peaks, errors;
  for (const Json& run : runs) {
    if (run["value"].is_null() || run["status"] != "done") continue;
    const double value = run["value"];
    if (const Json peak = run["figures"]["peak_force_N"]; peak.is_number()) peaks.emplace_back(value, peak);
    if (const Json error = run["figures"]["force_nrmse_pct"]; error.is_number()) errors.emplace_back(value, error);
  }
  if (peaks.size() < 2) return "";
  std::string text;
  if (const auto slope = logarithmic_slope(peaks))
    text += fmt::format("The estimated peak goes with {} to the power {:.3f}. ", experiment.key, *slope);
  if (!errors.empty()) {
    const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto best = *std::min_element(errors.begin(), errors.end(), less);
    const auto worst = *std::max_element(errors.begin(), errors.end(), less);
    text += fmt::format("The error is least, {:.1f} %, at {:g} {} and largest, {:.1f} %, at {:g} {}.", best.second,
                        best.first, experiment.unit, worst.second, worst.first, experiment.unit);
  }
  return text;
}

Json run_json(const StudyRun& run, const std::filesystem::path& folder) {
  const Json result = result_of(run, folder);
  Json json;
  json["name"] = run.name;
  json["label"] = run.value ? run.value->label : "";
  json["value"] = run.value && run.value->number ? Json(*run.value->number) : Json();
  json["status"] = result.is_null() ? "missing" : result["status"];
  json["reason"] = result.is_null() ? "not run yet" : result.value("reason", "");
  for (const auto& [name, title] : kColumns) json["figures"][name] = result.is_null() ? Json() : figure(result, name);
  json["warnings"] =
      result.is_null() || !result.contains("frames_by_warning") ? Json::object() : Json(result["frames_by_warning"]);
  if (json["status"] == "done")
    json["series"] = series_of(run_folder(run, folder) / "forces.csv",
                               run.sequence.empty() ? "" : sequence_folder(run.sequence, folder) / "truth.csv");
  return json;
}

Json experiment_json(const StudyExperiment& experiment, const StudyPlan& plan, const std::filesystem::path& folder) {
  Json json;
  json["name"] = experiment.name;
  json["title"] = experiment.title;
  json["paper"] = experiment.paper;
  json["says"] = experiment.says;
  json["key"] = experiment.key;
  json["unit"] = experiment.unit;
  json["logarithmic"] = experiment.logarithmic;
  json["goals"] = experiment.goals;
  json["expects_warning"] = experiment.expects_warning ? Json(*experiment.expects_warning) : Json();
  json["runs"] = Json::array();
  for (const StudyRun& run : plan.runs)
    if (run.experiment->name == experiment.name) json["runs"].push_back(run_json(run, folder));
  json["findings"] = findings_of(experiment, json["runs"]);
  if (experiment.values.empty() && !plan.runs.empty())
    for (const StudyRun& run : plan.runs)
      if (run.experiment->name == experiment.name) json["clip"] = data_uri(run_folder(run, folder) / "overlay.mp4");
  return json;
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

void write_table(const Json& experiments, const std::filesystem::path& file) {
  std::string table = "run,experiment,key,value,status,reason";
  for (const auto& [name, title] : kColumns) table += "," + name;
  table += ",warnings\n";
  for (const Json& experiment : experiments)
    for (const Json& run : experiment["runs"]) {
      const auto field = [](const Json& value) {
        return value.is_null() ? "" : csv_field(value.is_string() ? value.get<std::string>() : value.dump());
      };
      table += field(run["name"]) + "," + field(experiment["name"]) + "," + field(experiment["key"]) + "," +
               field(run["label"]) + "," + field(run["status"]) + "," + field(run["reason"]);
      for (const auto& [name, title] : kColumns) table += "," + field(run["figures"][name]);
      std::string warnings;
      for (const auto& [name, frames] : run["warnings"].items()) warnings += (warnings.empty() ? "" : ";") + name;
      table += "," + csv_field(warnings) + "\n";
    }
  write_file(file, table);
}

}  // namespace

StudyCount collect_study(const Study& study, const StudyPlan& plan, const std::filesystem::path& folder) {
  Json page;
  page["title"] = study.title;
  page["about"] = study.about;
  for (const auto& [name, title] : kColumns) page["columns"].push_back({{"name", name}, {"title", title}});
  page["experiments"] = Json::array();
  for (const StudyExperiment& experiment : study.experiments)
    page["experiments"].push_back(experiment_json(experiment, plan, folder));
  write_table(page["experiments"], folder / "results.csv");
  write_file(folder / "report.html", study_page_html(page));
  StudyCount count;
  for (const Json& experiment : page["experiments"])
    for (const Json& run : experiment["runs"])
      ++(run["status"] == "done" ? count.done : run["status"] == "failed" ? count.failed : count.missing);
  return count;
}

}  // namespace palpate::app
