#include "palpate/feedback/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/feedback/axis.h"

namespace palpate {
namespace {

constexpr int kLeft = 46, kRight = 12, kTop = 26, kBottom = 38, kLane = 20;

struct Interval {
  double min = std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::lowest();
  void include(double value) {
    if (!std::isfinite(value)) return;
    min = std::min(min, value);
    max = std::max(max, value);
  }
  bool empty() const { return max < min; }
};

/// Not empty and not a point.
Interval widened(const Interval& interval) {
  if (interval.empty()) return {0, 1};
  return {interval.min, interval.max - interval.min > 1e-9 ? interval.max : interval.min + 1};
}

/// From time and value to the SVG's own pixels.
struct Frame {
  Interval time_s, value;
  double value_step = 1;
  int width = 0, plot_bottom = 0;

  double x(double t) const { return kLeft + (t - time_s.min) / (time_s.max - time_s.min) * (width - kLeft - kRight); }
  double y(double v) const { return plot_bottom - (v - value.min) / (value.max - value.min) * (plot_bottom - kTop); }
};

/// All ticks of an interval whose ends are ticks.
std::vector<double> ticks_of_step(const Interval& interval, double step) {
  std::vector<double> ticks;
  for (double i = std::round(interval.min / step); i * step <= interval.max + 1e-9 * step; ++i)
    ticks.push_back(i * step);
  return ticks;
}

std::string axes(const Frame& frame, const Chart& chart, int height) {
  std::string svg;
  const int right = frame.width - kRight;
  for (const double tick : ticks_of_step(frame.value, frame.value_step)) {
    svg += fmt::format("<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>", kLeft, right,
                       frame.y(tick), frame.y(tick));
    svg += fmt::format("<text class=\"tick end\" x=\"{}\" y=\"{:.1f}\">{}</text>", kLeft - 6, frame.y(tick) + 4,
                       tick_text(tick));
  }
  for (const double tick : round_ticks(frame.time_s.min, frame.time_s.max, std::max(4, frame.width / 110))) {
    svg += fmt::format("<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", frame.x(tick),
                       frame.plot_bottom, frame.plot_bottom + 4);
    svg += fmt::format("<text class=\"tick middle\" x=\"{:.1f}\" y=\"{}\">{}</text>", frame.x(tick),
                       frame.plot_bottom + 17, tick_text(tick));
  }
  svg += fmt::format("<text class=\"title\" x=\"2\" y=\"14\">{}</text>", chart.value_title);
  svg += fmt::format("<text class=\"title end\" x=\"{}\" y=\"{}\">time (s)</text>", right, height - 5);
  return svg;
}

/// One polyline per stretch without a gap.
std::string curve(const Frame& frame, const ChartSeries& series) {
  std::string svg, points;
  const auto finish = [&] {
    if (!points.empty()) svg += fmt::format("<polyline class=\"{}\" points=\"{}\"/>", series.css_class, points);
    points.clear();
  };
  for (size_t i = 0; i < series.value.size(); ++i) {
    if (std::isfinite(series.value[i])) {
      points += fmt::format("{:.1f},{:.1f} ", frame.x(series.time_s[i]), frame.y(series.value[i]));
    } else {
      finish();
    }
  }
  finish();
  return svg;
}

std::string lane_svg(const Frame& frame, const ChartLane& lane, int top) {
  std::string svg;
  for (const ChartSpan& span : lane.spans)
    svg += fmt::format("<rect class=\"{}\" x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"10\"/>", span.css_class,
                       frame.x(span.from_s), top, std::max(0.5, frame.x(span.to_s) - frame.x(span.from_s)));
  return svg + fmt::format("<text class=\"tick\" x=\"2\" y=\"{}\">{}</text>", top + 9, lane.name);
}

}  // namespace

std::string svg_chart(const Chart& chart, int width_px, int height_px) {
  const int lanes_px = kLane * static_cast<int>(chart.lanes.size());
  Frame frame;
  frame.width = width_px;
  frame.plot_bottom = height_px - kBottom - lanes_px;
  for (const ChartSeries& series : chart.series) {
    for (const double t : series.time_s) frame.time_s.include(t);
    for (const double v : series.value) frame.value.include(v);
  }
  for (const ChartLane& l : chart.lanes)
    for (const ChartSpan& span : l.spans) frame.time_s.include(span.to_s);
  if (chart.from_zero) frame.value.include(0);
  frame.time_s = widened(frame.time_s);
  frame.value = widened(frame.value);
  const int steps = std::max(2, (frame.plot_bottom - kTop) / 30);
  frame.value_step = round_up((frame.value.max - frame.value.min) / steps);
  frame.value.min = std::floor(frame.value.min / frame.value_step + 1e-9) * frame.value_step;
  frame.value.max = std::ceil(frame.value.max / frame.value_step - 1e-9) * frame.value_step;

  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"{2} over time\" "
      "data-from-s=\"{3}\" data-to-s=\"{4}\" data-left=\"{5}\" data-right=\"{6}\">",
      width_px, height_px, chart.value_title, frame.time_s.min, frame.time_s.max, kLeft, width_px - kRight);
  svg += axes(frame, chart, height_px);
  for (const ChartSeries& series : chart.series) svg += curve(frame, series);
  int top = frame.plot_bottom + 24;
  for (const ChartLane& l : chart.lanes) {
    svg += lane_svg(frame, l, top);
    top += kLane;
  }
  svg += fmt::format("<line class=\"cursor\" y1=\"{}\" y2=\"{}\" x1=\"-9\" x2=\"-9\"/>", kTop, frame.plot_bottom);
  return svg + "</svg>";
}

}  // namespace palpate
