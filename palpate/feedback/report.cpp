#include "palpate/feedback/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "palpate/core/quantile.h"
#include "palpate/core/whole_file.h"
#include "palpate/feedback/axis.h"
#include "palpate/feedback/compare.h"
#include "palpate/feedback/report_page.h"
#include "palpate/feedback/svg_chart.h"
#include "palpate/feedback/warnings.h"

namespace palpate {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr int kWide_px = 940, kNarrow_px = 360;

std::string base64(const std::vector<uchar>& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](size_t k) { return k < bytes.size() ? static_cast<unsigned>(bytes[k]) : 0u; };
    const unsigned three = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    for (unsigned k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63];
  }
  return text;
}

bool has_answer(const ForceRow& row) {
  return row.status != "tool_lost" && row.status != "not_converged";
}

template <class ValueOf>
ChartSeries series_of(const std::string& name, const std::string& css_class, const std::vector<ForceRow>& rows,
                      ValueOf value_of) {
  ChartSeries series{name, css_class, {}, {}};
  for (const ForceRow& row : rows) {
    series.time_s.push_back(row.time_s);
    series.value.push_back(value_of(row));
  }
  return series;
}

/// Neighbouring frames with the same class become one span; frames without a class leave a gap.
template <class ClassOf>
ChartLane lane_of(const std::string& name, const std::vector<ForceRow>& rows, ClassOf class_of) {
  ChartLane lane{name, {}};
  for (size_t i = 0; i < rows.size(); ++i) {
    const std::string css_class = class_of(rows[i]);
    const double step_s = i + 1 < rows.size() ? rows[i + 1].time_s - rows[i].time_s
                          : i > 0             ? rows[i].time_s - rows[i - 1].time_s
                                              : 0.04;
    if (css_class.empty()) continue;
    if (!lane.spans.empty() && lane.spans.back().css_class == css_class &&
        std::abs(lane.spans.back().to_s - rows[i].time_s) < 1e-6) {
      lane.spans.back().to_s += step_s;
    } else {
      lane.spans.push_back({rows[i].time_s, rows[i].time_s + step_s, css_class});
    }
  }
  return lane;
}

/// The values of a chart for the script that shows them under the pointer.
std::string chart_data(const Chart& chart) {
  nlohmann::json data = nlohmann::json::array();
  for (const ChartSeries& series : chart.series) {
    nlohmann::json value = nlohmann::json::array(), time = nlohmann::json::array();
    for (size_t i = 0; i < series.value.size(); ++i) {
      time.push_back(std::round(series.time_s[i] * 1e4) / 1e4);
      value.push_back(std::isfinite(series.value[i]) ? nlohmann::json(std::round(series.value[i] * 1e4) / 1e4)
                                                     : nlohmann::json());
    }
    data.push_back({{"name", series.name}, {"time", time}, {"value", value}});
  }
  return data.dump();
}

/// Drawn twice, for a wide and for a narrow page, so that text keeps its size.
std::string chart_html(const Chart& chart, const std::string& unit, int height_px) {
  return fmt::format(
      "<div class=\"chart\" data-unit=\"{}\"><div class=\"wide\">{}</div><div class=\"narrow\">{}</div>"
      "<div class=\"readout\"></div><script type=\"application/json\">{}</script></div>\n",
      unit, svg_chart(chart, kWide_px, height_px), svg_chart(chart, kNarrow_px, height_px), chart_data(chart));
}

std::string card(const std::string& value, const std::string& name) {
  return fmt::format("<div class=\"card\"><b>{}</b><span>{}</span></div>", escape_html(value), escape_html(name));
}

std::string cards(const Report& report, const std::optional<Comparison>& comparison) {
  const auto peak = std::max_element(report.rows.begin(), report.rows.end(), [](const ForceRow& a, const ForceRow& b) {
    return a.force_magnitude_N < b.force_magnitude_N;
  });
  const double peak_N = peak == report.rows.end() ? 0 : peak->force_magnitude_N;
  std::string html = card(three_digits(peak_N) + " " + force_unit(report.tissue), "peak force");
  // Not the greatest stress of the run: in a frame where elements invert that number means nothing.
  if (peak_N > 0)
    html += card(three_digits(peak->max_von_mises_kPa) + " " + stress_unit(report.tissue),
                 "greatest von Mises stress then");
  if (comparison) {
    html += card(comparison->force_nrmse_pct ? fmt::format("{:.1f} %", *comparison->force_nrmse_pct) : "-",
                 "force error (NRMSE, of the true peak)");
    html += card(comparison->onset_error_frames ? fmt::format("{:+d} frames", *comparison->onset_error_frames) : "-",
                 "contact onset error");
    html +=
        card(comparison->tip_rmse_mm ? fmt::format("{:.2f} mm", *comparison->tip_rmse_mm) : "-", "tip error (RMSE)");
  }
  std::vector<double> frame_ms;
  for (const ForceRow& row : report.rows) frame_ms.push_back(row.frame_ms);
  html += card(fmt::format("{:.1f} ms", quantile_of(frame_ms, 0.5)),
               fmt::format("per frame (median; 99 %: {:.1f} ms)", quantile_of(frame_ms, 0.99)));
  const bool has_ratio = peak_N > 0 && report.tissue.young_modulus_kPa > 0;
  const std::string ratio = has_ratio ? fmt::format("at the peak F/E = {} mm&sup2;; ",
                                                    three_digits(peak_N / report.tissue.young_modulus_MPa()))
                                      : "";
  return "<div class=\"cards\">" + html + "</div>\n" +
         fmt::format(
             "<p class=\"note\">Tissue assumed: {}, E {} {}, &nu; = {}. The force is proportional to the "
             "Young&rsquo;s modulus assumed: {}twice the modulus, twice the force.</p>\n",
             law_name(report.tissue.law), report.tissue.modulus_unknown ? "is" : "=", modulus_text(report.tissue),
             tick_text(report.tissue.poisson_ratio), ratio);
}

/// What a reader must know before the curves.
std::string notes(const std::vector<ForceRow>& rows) {
  std::string html;
  const bool never_seen =
      std::all_of(rows.begin(), rows.end(), [](const ForceRow& r) { return r.status == "tool_lost"; });
  if (!rows.empty() && never_seen)
    html += "<p class=\"note\">No instrument was seen in any frame: there is no contact and no force.</p>\n";
  std::string items;
  for (const auto& [name, frames] : count_warnings(rows))
    items += fmt::format("<li>{} <span class=\"faint\">({} of {} frames, <code>{}</code>)</span></li>",
                         escape_html(warning_words(name)), frames, rows.size(), escape_html(name));
  if (!items.empty()) html += "<div class=\"note caution\">Warnings<ul>" + items + "</ul></div>\n";
  return html;
}

std::string force_section(const Report& report) {
  Chart chart;
  chart.value_title = fmt::format("force of the instrument on the tissue ({})", force_unit(report.tissue));
  chart.from_zero = true;
  const auto force = [](const ForceRow& row) { return has_answer(row) ? row.force_magnitude_N : kGap; };
  chart.series.push_back(series_of("estimate", "estimate", report.rows, force));
  if (!report.truth.empty()) chart.series.push_back(series_of("truth", "truth", report.truth, force));
  if (!report.rows_2.empty())
    chart.series.push_back(series_of("instrument 2", "estimate second", report.rows_2, force));
  if (!report.truth_2.empty())
    chart.series.push_back(series_of("truth of instrument 2", "truth second", report.truth_2, force));
  const auto status = [](const ForceRow& row) { return row.status; };
  chart.lanes.push_back(lane_of("status", report.rows, status));
  if (!report.rows_2.empty()) chart.lanes.push_back(lane_of("second", report.rows_2, status));
  if (!report.truth.empty())
    chart.lanes.push_back(
        lane_of("truth", report.truth, [](const ForceRow& row) { return row.in_contact ? "true_contact" : ""; }));

  std::map<std::string, int> frames;
  for (const ForceRow& row : report.rows) ++frames[row.status];
  std::string counts;
  for (const auto& [name, count] : frames)
    counts += fmt::format("{}{}: {}", counts.empty() ? "" : ", ", escape_html(name), count);
  std::string legend = "<span><i class=\"curve estimate\"></i>estimate</span>";
  if (!report.truth.empty()) legend += "<span><i class=\"curve truth\"></i>truth</span>";
  if (!report.rows_2.empty()) legend += "<span><i class=\"curve estimate second\"></i>instrument 2</span>";
  legend +=
      "<span><i class=\"ok\"></i>contact</span><span><i class=\"no_contact\"></i>no contact</span>"
      "<span><i class=\"doubt\"></i>lost, not converged or stale</span>";
  if (!report.truth.empty()) legend += "<span><i class=\"true_contact\"></i>true contact</span>";
  return "<h2>Force over time</h2>\n<div class=\"legend\">" + legend + "</div>" +
         chart_html(chart, force_unit(report.tissue), 320) +
         fmt::format("<p class=\"faint\">{} frames ({})</p>\n", report.rows.size(), counts);
}

std::string tip_section(const Report& report) {
  std::string html = "<h2>Tip of the instrument, left camera frame</h2>\n";
  const char* const axes[] = {"x (mm), right", "y (mm), down", "z (mm), away from the camera"};
  for (int axis = 0; axis < 3; ++axis) {
    const auto tip = [axis](const ForceRow& row) { return row.has_tip() ? row.tip_mm[axis] : kGap; };
    Chart chart;
    chart.value_title = axes[axis];
    chart.series.push_back(series_of("estimate", "estimate", report.rows, tip));
    if (!report.truth.empty()) chart.series.push_back(series_of("truth", "truth", report.truth, tip));
    html += chart_html(chart, "mm", 190);
  }
  return html;
}

std::string comparison_table(const Comparison& comparison) {
  std::string rows;
  for (const auto& [name, figure] : figures_of(comparison))
    rows += fmt::format("<tr><td>{}</td><td class=\"number\">{}</td></tr>", name, figure_text(figure));
  return "<div><h2>Against the truth</h2><div class=\"scroll\"><table>" + rows + "</table></div></div>\n";
}

std::string times_table(const std::vector<FrameTimes>& times) {
  const std::pair<const char*, double FrameTimes::*> stages[] = {{"rectify", &FrameTimes::rectify_ms},
                                                                 {"track the instrument", &FrameTimes::track_ms},
                                                                 {"find the contact", &FrameTimes::contact_ms},
                                                                 {"solve", &FrameTimes::solve_ms},
                                                                 {"stress", &FrameTimes::stress_ms},
                                                                 {"draw", &FrameTimes::draw_ms}};
  std::string rows;
  const auto add = [&](const char* name, const std::vector<double>& ms) {
    rows += fmt::format("<tr><td>{}</td><td class=\"number\">{:.2f}</td><td class=\"number\">{:.2f}</td></tr>", name,
                        quantile_of(ms, 0.5), quantile_of(ms, 0.99));
  };
  std::vector<double> ms(times.size());
  for (const auto& [name, stage] : stages) {
    std::transform(times.begin(), times.end(), ms.begin(), [part = stage](const FrameTimes& t) { return t.*part; });
    add(name, ms);
  }
  std::transform(times.begin(), times.end(), ms.begin(), [](const FrameTimes& t) { return t.total_ms(); });
  add("whole frame", ms);
  return "<div><h2>Time per frame (ms)</h2><div class=\"scroll\"><table><tr><th>stage</th><th "
         "class=\"number\">median</th>"
         "<th class=\"number\">99 %</th></tr>" +
         rows + "</table></div></div>\n";
}

std::string picture_section(const std::vector<ReportPicture>& pictures) {
  std::string html = "<h2>Stress on the tissue</h2>\n<div class=\"pictures\">";
  for (const ReportPicture& picture : pictures) {
    std::vector<uchar> jpeg;
    cv::imencode(".jpg", picture.image, jpeg, {cv::IMWRITE_JPEG_QUALITY, 85});
    html +=
        fmt::format("<figure><img alt=\"{0}\" src=\"data:image/jpeg;base64,{1}\"><figcaption>{0}</figcaption></figure>",
                    escape_html(picture.caption), base64(jpeg));
  }
  return html + "</div>\n";
}

}  // namespace

std::string report_html(const Report& report) {
  std::optional<Comparison> comparison;
  if (!report.truth.empty()) comparison = compare(report.rows, report.truth);
  std::string body = "<h1>" + escape_html(report.title) +
                     "</h1>\n<p class=\"faint\">Palpate: force and stress from a "
                     "stereo endoscope. Research use only, not a medical device.</p>\n";
  body += cards(report, comparison);
  body += notes(report.rows);
  body += force_section(report);
  if (!report.pictures.empty()) body += picture_section(report.pictures);
  body += tip_section(report);
  body += "<div class=\"tables\">";
  if (comparison) body += comparison_table(*comparison);
  if (!report.times.empty()) body += times_table(report.times);
  body += "</div>\n";
  if (!report.settings.empty())
    body += "<h2>Settings in effect</h2>\n<pre>" + escape_html(report.settings) + "</pre>\n";
  body +=
      "<footer class=\"faint\">Force = force of the instrument on the tissue, in N, left camera frame (x right, y "
      "down, "
      "z away from the camera). Method: Haouchine, Kuang, Cotin, Yip, IEEE RA-L 2018. Research use only; this is not a "
      "medical device and must not guide treatment.</footer>";
  return html_page(report.title, body);
}

void write_report(const std::filesystem::path& file, const Report& report) {
  write_whole_file(file, report_html(report));
}

}  // namespace palpate
