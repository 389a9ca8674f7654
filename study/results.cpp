#include "study/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "palpate/core/errors.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/feedback/sensor_log.h"
#include "study/slopes.h"
#include "study/work.h"

namespace palpate::study {

namespace {

using Json = nlohmann::ordered_json;

/// Figures of the comparison first, then those of a sensor's log, of the run and of the map.
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
    {"sensor_rmse_N", "against the sensor, N RMS"},
    {"sensor_nrmse_pct", "against the sensor, % of its peak"},
    {"sensor_scale", "one factor"},
    {"sensor_nrmse_scaled_pct", "after that factor, %"},
    {"sensor_correlation", "correlation with the sensor"},
    {"elements", "elements"},
    {"coverage_pct", "depth measured, % of the region"},
    {"map_s", "map, s"},
    {"median_frame_ms", "frame, ms median"},
    {"p99_frame_ms", "frame, ms 99 %"},
    {"stage_track_ms", "of it in contact: instrument, ms"},
    {"stage_solve_ms", "equilibrium, ms"},
    {"stage_stress_ms", "stress, ms"},
    {"stage_draw_ms", "overlay, ms"},
    {"frames_per_second", "frames per second"},
    {"statuses", "frames"},
};

/// Their names in the answer of palpate compare --sensor.
const std::map<std::string, std::string> kOfSensor = {{"sensor_rmse_N", "force_rmse_N"},
                                                      {"sensor_nrmse_pct", "force_nrmse_pct"},
                                                      {"sensor_scale", "scale"},
                                                      {"sensor_nrmse_scaled_pct", "force_nrmse_scaled_pct"},
                                                      {"sensor_correlation", "force_correlation"}};

Json read_json(const std::filesystem::path& file) {
  std::ifstream stream(file);
  Json json = stream ? Json::parse(stream, nullptr, false) : Json();
  return json.is_discarded() ? Json() : json;
}

/// What the frames were, where there is no truth or some claim less than a force or its absence; elsewhere onset,
/// release and false contact say it.
Json statuses_of(const Json& result) {
  if (!result.contains("frames_by_status")) return {};
  const Json& frames = result["frames_by_status"];
  const bool all_told =
      !frames.contains("map_stale") && !frames.contains("not_converged") && !frames.contains("tool_lost");
  if (result.contains("comparison") && all_told) return {};
  std::string text;
  for (const auto& [status, count] : result["frames_by_status"].items())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.get<int>(), status);
  return text;
}

Json figures_of(const Json& result, const std::filesystem::path& place) {
  const Json map = read_json(place / "map.json");
  const Json sensor = result.value("sensor", Json::object()), comparison = result.value("comparison", Json::object());
  Json figures;
  for (const auto& [name, title] : kColumns) {
    const bool of_sensor = name.starts_with("sensor_");
    const Json& group = of_sensor ? sensor : comparison.contains(name) ? comparison : result;
    const std::string key = of_sensor ? kOfSensor.at(name) : name;
    figures[name] = group.contains(key) ? group[key] : Json();
  }
  if (map.contains("coverage")) figures["coverage_pct"] = 100 * map["coverage"].get<double>();
  figures["statuses"] = statuses_of(result);
  // Without an instrument there is no force to tell.
  if (comparison.empty() && figures["peak_force_N"] == 0.0)
    figures["peak_force_N"] = figures["peak_force_per_modulus_N_per_kPa"] = Json();
  return figures;
}

Json points_of(const std::vector<ForceRow>& rows) {
  Json points = Json::array();
  for (const ForceRow& row : rows)
    points.push_back({{"x", row.time_s}, {"y", std::round(row.force_magnitude_N * 1e4) / 1e4}});
  return points;
}

/// The sensor's log in the time of the video, as palpate compare --sensor aligns it.
Json aligned_points(const std::vector<ForceRow>& estimate, const std::filesystem::path& log) {
  const auto readings = read_sensor_log(log);
  Json points = Json::array();
  for (const SensorReading& reading : aligned(readings, compare_with_sensor(estimate, readings)))
    if (reading.time_s >= 0 && reading.time_s <= estimate.back().time_s)
      points.push_back(
          {{"x", std::round(reading.time_s * 1e3) / 1e3}, {"y", std::round(reading.force_N.norm() * 1e3) / 1e3}});
  return points;
}

Json series_of(const std::filesystem::path& forces, const std::filesystem::path& truth) {
  Json series;
  try {
    const std::vector<ForceRow> estimate = read_forces(forces);
    series["estimate"] = points_of(estimate);
    if (truth.empty()) return series;
    series["truth"] = points_of(read_truth(truth));
    if (const auto log = truth.parent_path() / "sensor.csv"; std::filesystem::exists(log))
      series["sensor"] = aligned_points(estimate, log);
  } catch (const BadInput&) {
    return series;
  }
  return series;
}

Json run_json(const Run& run, const std::filesystem::path& folder) {
  const Json result = result_of(run, folder);
  Json json;
  json["name"] = run.name;
  json["label"] = run.value ? run.value->label : "";
  json["value"] = run.value && run.value->number ? Json(*run.value->number) : Json();
  json["status"] = result.is_null() ? "missing" : result["status"];
  json["reason"] = result.is_null() ? "not run yet" : result.value("reason", "");
  json["real"] = run.sequence.empty();
  json["figures"] = figures_of(result.is_null() ? Json::object() : result, run_folder(run, folder));
  json["warnings"] =
      result.is_null() || !result.contains("frames_by_warning") ? Json::object() : Json(result["frames_by_warning"]);
  if (json["status"] == "done")
    json["series"] = series_of(run_folder(run, folder) / "forces.csv",
                               run.sequence.empty() ? "" : sequence_folder(run.sequence, folder) / "truth.csv");
  return json;
}

using Points = std::vector<std::pair<double, double>>;

/// One figure of the runs that are done over the swept number.
Points over_setting(const Json& runs, const std::string& name) {
  Points points;
  for (const Json& run : runs)
    if (run["status"] == "done" && run["value"].is_number() && run["figures"][name].is_number())
      points.emplace_back(run["value"].get<double>(), run["figures"][name].get<double>());
  return points;
}

/// "-1.2 +- 0.3 % of the true force per mm".
std::string slope_text(const Experiment& experiment, const Slope& slope) {
  if (experiment.logarithmic)
    return fmt::format("the force goes with it to the power {:.3f}", slope.slope) +
           (slope.error ? fmt::format(" ± {:.3f}", *slope.error) : "");
  const std::string unit = experiment.unit.empty() ? "unit" : experiment.unit;
  return fmt::format("{:+.2f}", 100 * slope.slope) + (slope.error ? fmt::format(" ± {:.2f}", 100 * *slope.error) : "") +
         " % of the true force per " + unit;
}

std::string uncertainty_text(const Experiment& experiment) {
  if (experiment.logarithmic) return fmt::format("a factor of {:g}", *experiment.uncertainty);
  return fmt::format("{:g} {}", *experiment.uncertainty, experiment.unit);
}

Json sensitivity_of(const Experiment& experiment, const Json& runs) {
  const auto slope = slope_of(over_setting(runs, "gain"), experiment.logarithmic);
  if (!slope) return {};
  Json json = {{"slope", slope->slope}, {"at_zero", slope->at_zero}, {"text", slope_text(experiment, *slope)}};
  if (experiment.uncertainty) {
    json["uncertainty"] = uncertainty_text(experiment);
    json["effect_pct"] = 100 * effect_of(*slope, *experiment.uncertainty, experiment.logarithmic);
  }
  return json;
}

/// What named cases (attachments, say) make of the force against the first of them, without those that the program
/// recognised by the warning that was expected.
Json sensitivity_of_cases(const Experiment& experiment, const Json& runs) {
  if (runs.size() < 2 || !runs[0]["figures"]["gain"].is_number()) return {};
  const double first = runs[0]["figures"]["gain"];
  double largest = 0;
  int cases = 0;
  for (const Json& run : runs) {
    if (!run["figures"]["gain"].is_number()) continue;
    if (experiment.expects_warning && run["warnings"].contains(*experiment.expects_warning)) continue;
    const double change = run["figures"]["gain"].get<double>() / first - 1;
    if (std::abs(change) > std::abs(largest)) largest = change;
    ++cases;
  }
  if (cases < 2) return {};
  return {{"text", "the one that changes it most"},
          {"uncertainty", fmt::format("another of {} cases", cases)},
          {"effect_pct", 100 * largest}};
}

/// What a sweep of numbers says in words.
std::string findings_of(const Experiment& experiment, const Json& runs, const Json& sensitivity) {
  std::string text;
  const std::string unit = experiment.unit.empty() ? "" : " " + experiment.unit;
  const Points errors = over_setting(runs, "force_nrmse_pct");
  if (const auto slope = slope_of(over_setting(runs, "peak_force_N"), true); slope && experiment.logarithmic)
    text += fmt::format("The estimated peak goes with {} to the power {:.3f}. ", experiment.key, slope->slope);
  else if (sensitivity.contains("slope"))
    text += fmt::format("Slope: {}. ", sensitivity["text"].get<std::string>());
  if (errors.size() >= 2) {
    const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto best = *std::min_element(errors.begin(), errors.end(), less);
    const auto worst = *std::max_element(errors.begin(), errors.end(), less);
    if (worst.second - best.second < 0.05)
      text += fmt::format("The error is {:.1f} % at every value.", best.second);
    else
      text += fmt::format("The error is least, {:.3g} %, at {:g}{} and largest, {:.3g} %, at {:g}{}.", best.second,
                          best.first, unit, worst.second, worst.first, unit);
  }
  return text;
}

Json experiment_json(const Experiment& experiment, const Plan& plan, const std::filesystem::path& folder) {
  Json json;
  json["name"] = experiment.name;
  json["title"] = experiment.title;
  json["paper"] = experiment.paper;
  json["says"] = experiment.says;
  json["why"] = experiment.why;
  json["key"] = experiment.key;
  json["unit"] = experiment.unit;
  json["logarithmic"] = experiment.logarithmic;
  json["known"] = experiment.known ? Json(*experiment.known) : Json();
  json["goals"] = experiment.goals;
  json["expects_warning"] = experiment.expects_warning ? Json(*experiment.expects_warning) : Json();
  json["runs"] = Json::array();
  for (const Run& run : plan.runs)
    if (run.experiment->name == experiment.name) json["runs"].push_back(run_json(run, folder));
  const bool numbers = std::any_of(experiment.values.begin(), experiment.values.end(),
                                   [](const Value& value) { return value.number.has_value(); });
  json["sensitivity"] =
      numbers ? sensitivity_of(experiment, json["runs"]) : sensitivity_of_cases(experiment, json["runs"]);
  json["findings"] = findings_of(experiment, json["runs"], json["sensitivity"]);
  return json;
}

/// Swept settings, the one whose uncertainty changes the force most first.
Json ranking_of(const Json& experiments) {
  std::vector<Json> rows;
  for (const Json& experiment : experiments) {
    const Json& found = experiment["sensitivity"];
    if (!found.contains("effect_pct")) continue;
    rows.push_back({{"experiment", experiment["name"]},
                    {"title", experiment["title"]},
                    {"uncertainty", found["uncertainty"]},
                    {"slope", found["text"]},
                    {"effect_pct", found["effect_pct"]}});
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Json& a, const Json& b) {
    return std::abs(a["effect_pct"].get<double>()) > std::abs(b["effect_pct"].get<double>());
  });
  return rows;
}

}  // namespace

Json gather_study(const Study& study, const Plan& plan, const std::filesystem::path& folder) {
  Json page;
  page["title"] = study.title;
  page["about"] = study.about;
  for (const auto& [name, title] : kColumns) page["columns"].push_back({{"name", name}, {"title", title}});
  page["experiments"] = Json::array();
  for (const Experiment& experiment : study.experiments)
    if (std::any_of(plan.runs.begin(), plan.runs.end(),
                    [&experiment](const Run& run) { return run.experiment->name == experiment.name; }))
      page["experiments"].push_back(experiment_json(experiment, plan, folder));
  page["ranking"] = ranking_of(page["experiments"]);
  return page;
}

std::string short_number(const Json& value) {
  if (value.is_null()) return "-";
  if (!value.is_number()) return value.is_string() ? value.get<std::string>() : value.dump();
  const double number = value;
  const double size = std::abs(number);
  if (size >= 1e6 || (size > 0 && size < 0.001)) return fmt::format("{:.3g}", number);
  if (value.is_number_integer() || size >= 100) return fmt::format("{:.0f}", number);
  return size >= 10    ? fmt::format("{:.1f}", number)
         : size >= 0.1 ? fmt::format("{:.2f}", number)
                       : fmt::format("{:.3g}", number);
}

}  // namespace palpate::study
