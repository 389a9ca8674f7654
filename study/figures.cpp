#include "study/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "study/engines.h"
#include "study/files.h"
#include "study/results.h"
#include "study/work.h"

namespace palpate::study {

namespace {

using Json = nlohmann::ordered_json;
using Points = std::vector<std::pair<double, double>>;

constexpr int kPictureWidth_px = 640;
constexpr int kPictureQuality = 82;
/// Forces that differ by more than this factor are shown on a logarithmic axis.
constexpr double kWideRange = 10;
const std::array<const char*, 8> kColours = {"#2f6fde", "#d9822b", "#2a9d6f", "#b3459b",
                                             "#7a6ff0", "#c0392b", "#5d8a00", "#008b9a"};

struct Curve {
  std::string label;
  Points points;
  enum class Style { line, dots, dashes } style = Style::line;
};

struct Chart {
  std::string name, title, x, y;
  std::vector<Curve> curves;
  bool logarithmic_x = false, logarithmic_y = false, from_zero = true;
  std::optional<double> mark_x, mark_y;
  std::string mark_label;
};

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return result + "\"";
}

std::string plot_of(const Curve& curve, size_t index) {
  const bool truth = curve.style == Curve::Style::dashes;
  const std::string style = curve.style == Curve::Style::dots ? "linespoints pt 7 ps 0.6 lw 2"
                            : truth                           ? "lines lw 2 dt (6,4)"
                                                              : "lines lw 2";
  return fmt::format("$curve{} with {} lc rgb \"{}\" title {}", index, style,
                     truth ? "#777777" : kColours[index % kColours.size()], quoted(curve.label));
}

std::string script_of(const Chart& chart) {
  std::string script = "reset\nset terminal svg noenhanced size 600,380 font \"sans-serif,13\" background \"white\"\n";
  script += fmt::format("set output {}\nset title {}\nset xlabel {}\nset ylabel {}\n", quoted(chart.name + ".svg"),
                        quoted(chart.title), quoted(chart.x), quoted(chart.y));
  script +=
      "set border 3\nset tics nomirror\nset grid lc rgb \"#dddddd\"\nset key below horizontal samplen 2\nset xzeroaxis "
      "lc rgb \"#999999\"\n";
  if (chart.logarithmic_x) script += "set logscale x\n";
  if (chart.logarithmic_y)
    script += "set logscale y\nset format y \"%.0e\"\n";
  else if (chart.from_zero)
    script += "set yrange [0:*]\n";
  if (chart.mark_x)
    script += fmt::format(
        "set arrow from first {0}, graph 0 to first {0}, graph 1 nohead dt (2,3) lc rgb \"#555555\"\n", *chart.mark_x);
  if (chart.mark_y)
    script += fmt::format(
        "set arrow from graph 0, first {0} to graph 1, first {0} nohead dt (2,3) lc rgb \"#555555\"\n", *chart.mark_y);
  std::string plots;
  for (size_t i = 0; i < chart.curves.size(); ++i) {
    script += fmt::format("$curve{} << END\n", i);
    for (const auto& [x, y] : chart.curves[i].points) script += fmt::format("{:.6g} {:.6g}\n", x, y);
    script += "END\n";
    plots += (i == 0 ? "" : ", ") + plot_of(chart.curves[i], i);
  }
  if (!chart.mark_label.empty())
    plots += fmt::format(", NaN with lines dt (2,3) lc rgb \"#555555\" title {}", quoted(chart.mark_label));
  return script + "plot " + plots + "\n";
}

Points series(const Json& points) {
  Points result;
  for (const Json& point : points) result.emplace_back(point["x"].get<double>(), point["y"].get<double>());
  return result;
}

std::string goal_text(const Json& experiment, const Json& run) {
  std::string text;
  const auto add = [&](const char* name, const char* words, const char* unit) {
    const Json& value = run["figures"][name];
    if (!value.is_number()) return;
    text += fmt::format("{}{} {:.1f} {}", text.empty() ? "" : ", ", words, value.get<double>(), unit);
    if (experiment["goals"].contains(name))
      text += fmt::format(" (goal {:g})", experiment["goals"][name].get<double>());
  };
  add("force_nrmse_pct", "force error", "% of the true peak");
  add("direction_error_deg_median", "direction", "degrees");
  return text;
}

/// Forces of all runs over time, and the truth of the first that has one.
std::optional<Chart> force_chart(const Json& experiment) {
  Chart chart;
  chart.name = experiment["name"].get<std::string>() + "_force";
  chart.title = experiment["title"];
  chart.x = "time (s)";
  chart.y = "force (N)";
  Json truth;
  for (const Json& run : experiment["runs"]) {
    if (run["status"] != "done" || run["real"] || !run["series"].contains("estimate")) continue;
    if (experiment["runs"].size() == 1) chart.title += "\n" + goal_text(experiment, run);
    const std::string label = run["label"];
    chart.curves.push_back({label.empty() ? "estimate" : label, series(run["series"]["estimate"])});
    if (truth.is_null() && run["series"].contains("truth")) truth = run["series"]["truth"];
  }
  if (chart.curves.empty()) return std::nullopt;
  if (!truth.is_null()) chart.curves.push_back({"truth", series(truth), Curve::Style::dashes});
  return chart;
}

/// What palpate compare --sensor made of the log: both in the time of the video.
std::optional<Chart> sensor_chart(const Json& experiment) {
  for (const Json& run : experiment["runs"]) {
    if (!run.contains("series") || !run["series"].contains("sensor")) continue;
    Chart chart;
    chart.name = experiment["name"].get<std::string>() + "_sensor";
    const double scale = run["figures"]["sensor_scale"], error = run["figures"]["sensor_nrmse_pct"],
                 scaled = run["figures"]["sensor_nrmse_scaled_pct"], r = run["figures"]["sensor_correlation"];
    chart.title =
        fmt::format("{}, against the sensor's log\nerror {:.1f} %, after one factor {:.1f} %, correlation {:.3f}",
                    experiment["title"].get<std::string>(), error, scaled, r);
    chart.x = "time of the video (s)";
    chart.y = "force (N)";
    Points estimate = series(run["series"]["estimate"]), times_scale = estimate;
    for (auto& [time_s, force_N] : times_scale) force_N *= scale;
    chart.curves = {{"estimate", estimate},
                    {fmt::format("estimate times {:.2f}", scale), times_scale},
                    {"sensor", series(run["series"]["sensor"]), Curve::Style::dashes}};
    return chart;
  }
  return std::nullopt;
}

Points over(const Json& experiment, const std::string& name) {
  Points points;
  for (const Json& run : experiment["runs"])
    if (run["status"] == "done" && run["value"].is_number() && run["figures"][name].is_number())
      points.emplace_back(run["value"].get<double>(), run["figures"][name].get<double>());
  std::sort(points.begin(), points.end());
  return points;
}

bool is_wide(const Points& points) {
  double min = INFINITY, max = 0;
  for (const auto& [x, y] : points) {
    min = std::min(min, y);
    max = std::max(max, y);
  }
  return min > 0 && max > kWideRange * min;
}

/// Error of the force, and how much too strong or too weak it is, over the swept setting.
Chart error_chart(const Json& experiment, const std::string& axis) {
  Chart chart;
  chart.name = experiment["name"].get<std::string>() + "_error";
  chart.title = experiment["title"];
  chart.x = axis;
  chart.y = "error of the force (%)";
  chart.logarithmic_x = experiment["logarithmic"];
  chart.from_zero = false;
  chart.curves.push_back({"RMS error", over(experiment, "force_nrmse_pct"), Curve::Style::dots});
  Points too_strong = over(experiment, "gain");
  for (auto& [value, gain] : too_strong) gain = 100 * (gain - 1);
  chart.curves.push_back({"too strong (+), weak (-)", too_strong, Curve::Style::dots});
  const Json& found = experiment["sensitivity"];
  if (found.contains("slope") && !too_strong.empty()) {
    const double slope = found["slope"], at_zero = found["at_zero"];
    const auto line = [&](double value) {
      return 100 *
             (chart.logarithmic_x ? std::exp(at_zero + slope * std::log(value)) - 1 : at_zero + slope * value - 1);
    };
    const double from = too_strong.front().first, to = too_strong.back().first;
    chart.curves.push_back({"fit", {{from, line(from)}, {to, line(to)}}, Curve::Style::dashes});
    chart.title += "\n" + found["text"].get<std::string>();
  }
  if (experiment["known"].is_number()) {
    chart.mark_x = experiment["known"].get<double>();
    chart.mark_label = "the scene says";
  }
  return chart;
}

/// Forces that span decades: logarithmic, with the line of proportionality; and what stays constant then.
void add_wide_charts(const Json& experiment, const std::string& axis, std::vector<Chart>& charts) {
  Chart chart;
  chart.name = experiment["name"].get<std::string>() + "_force";
  chart.title = experiment["title"];
  chart.x = axis;
  chart.y = "peak force (N)";
  chart.logarithmic_x = chart.logarithmic_y = true;
  const Points peaks = over(experiment, "peak_force_N");
  chart.curves.push_back({"estimated peak", peaks, Curve::Style::dots});
  const auto [first, last] = std::pair(peaks.front(), peaks.back());
  chart.curves.push_back(
      {"proportional", {first, {last.first, first.second * last.first / first.first}}, Curve::Style::line});
  chart.curves.push_back({"true peak", over(experiment, "true_peak_N"), Curve::Style::dashes});
  charts.push_back(chart);
  chart.name = experiment["name"].get<std::string>() + "_ratio";
  chart.y = "peak force / E (N/kPa)";
  chart.logarithmic_y = false;
  chart.curves = {{"estimated", over(experiment, "peak_force_per_modulus_N_per_kPa"), Curve::Style::dots}};
  charts.push_back(chart);
}

std::vector<Chart> charts_of(const Json& experiment) {
  std::vector<Chart> charts;
  const Points peaks = over(experiment, "peak_force_N");
  if (peaks.size() >= 2) {
    const std::string unit = experiment["unit"];
    const std::string axis = experiment["key"].get<std::string>() + (unit.empty() ? "" : " (" + unit + ")");
    if (is_wide(peaks))
      add_wide_charts(experiment, axis, charts);
    else if (over(experiment, "force_nrmse_pct").size() >= 2)
      charts.push_back(error_chart(experiment, axis));
    if (experiment["key"] == "map.elements") {
      Chart time;
      time.name = experiment["name"].get<std::string>() + "_time";
      time.title = "Time per frame";
      time.x = axis;
      time.y = "median (ms)";
      time.logarithmic_x = true;
      time.curves.push_back({"two images to overlay", over(experiment, "median_frame_ms"), Curve::Style::dots});
      time.mark_y = 40;
      time.mark_label = "the paper: 25 per second";
      charts.push_back(time);
    }
    return charts;
  }
  for (const auto& chart : {force_chart(experiment), sensor_chart(experiment)})
    if (chart) charts.push_back(*chart);
  return charts;
}

bool write_picture(cv::Mat picture, const std::filesystem::path& file) {
  if (picture.empty()) return false;
  if (picture.cols > kPictureWidth_px)
    cv::resize(picture, picture, {}, double(kPictureWidth_px) / picture.cols, double(kPictureWidth_px) / picture.cols,
               cv::INTER_AREA);
  return cv::imwrite(file.string(), picture, {cv::IMWRITE_JPEG_QUALITY, kPictureQuality});
}

/// The overlay at the greatest force; of a real recording, where no force is known, the map.
void add_picture(const Run& run, const Json& of_run, Json& pictures, const std::filesystem::path& folder) {
  std::string name = run.name;
  std::replace(name.begin(), name.end(), '/', '_');
  const std::filesystem::path file = std::filesystem::path("figures") / (name + ".jpg");
  if (of_run["real"]) {
    if (write_picture(cv::imread((run_folder(run, folder) / "preview.png").string()), folder / file))
      pictures.push_back({{"file", file.string()}, {"caption", "Map of " + of_run["label"].get<std::string>()}});
    return;
  }
  const Points forces = series(of_run["series"].value("estimate", Json::array()));
  const auto peak =
      std::max_element(forces.begin(), forces.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (peak == forces.end()) return;
  cv::VideoCapture video((run_folder(run, folder) / "overlay.mp4").string());
  cv::Mat picture;
  for (auto frame = forces.begin(); frame <= peak && video.read(picture); ++frame) {
  }
  if (write_picture(picture, folder / file))
    pictures.push_back({{"file", file.string()},
                        {"caption", fmt::format("The overlay at the greatest force, {:.2f} s", peak->first)}});
}

}  // namespace

bool write_study_figures(Json& page, const Plan& plan, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "figures");
  std::vector<std::string> scripts = {"gnuplot"};
  for (Json& experiment : page["experiments"]) {
    experiment["pictures"] = Json::array();
    for (const Chart& chart : charts_of(experiment)) {
      write_file(folder / "figures" / (chart.name + ".gp"), script_of(chart));
      scripts.push_back(chart.name + ".gp");
      experiment["pictures"].push_back(
          {{"file", "figures/" + chart.name + ".svg"}, {"caption", chart.title.substr(0, chart.title.find('\n'))}});
    }
    for (const Run& run : plan.runs) {
      if (run.experiment->name != experiment["name"]) continue;
      for (const Json& of_run : experiment["runs"]) {
        if (of_run["name"] != run.name || of_run["status"] != "done") continue;
        const bool is_single = experiment["runs"].size() == 1;
        if (of_run["real"] || is_single) add_picture(run, of_run, experiment["pictures"], folder);
        if (is_single && std::filesystem::exists(run_folder(run, folder) / "overlay.mp4"))
          experiment["clip"] = (run_folder(run, "") / "overlay.mp4").string();
      }
    }
  }
  const bool drew = scripts.size() == 1 || run_program(scripts, folder / "figures") == 0;
  const auto is_there = [&folder](const Json& picture) {
    std::error_code none;
    const auto size = std::filesystem::file_size(folder / picture["file"].get<std::string>(), none);
    return !none && size > 0;
  };
  for (Json& experiment : page["experiments"]) {
    Json there = Json::array();
    for (const Json& picture : experiment["pictures"])
      if (is_there(picture)) there.push_back(picture);
    experiment["pictures"] = there;
  }
  return drew;
}

}  // namespace palpate::study
