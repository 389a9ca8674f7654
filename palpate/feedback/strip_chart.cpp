#include "palpate/feedback/strip_chart.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "palpate/feedback/axis.h"
#include "palpate/feedback/draw.h"

namespace palpate {

namespace {
/// End of the axis at first: a small force; for one kPa of a soft tissue a hundredth of it.
constexpr double kFirstMax_N = 0.1, kFirstMaxPerModulus = 0.001;
}  // namespace

StripChart::StripChart(double duration_s, std::string unit)
    : duration_s_(duration_s), unit_(std::move(unit)), max_N_(unit_ == "N" ? kFirstMax_N : kFirstMaxPerModulus) {}

void StripChart::add(double time_s, std::optional<double> force_N) {
  samples_.push_back({time_s, force_N});
  while (samples_.front().time_s < time_s - duration_s_) samples_.pop_front();
  if (force_N && *force_N > 0) max_N_ = std::max(max_N_, round_up(1.05 * *force_N));
}

void StripChart::draw(cv::Mat& image, const cv::Rect& area, const cv::Scalar& colour, double scale) const {
  draw_veil(image, area);
  const double text_px = 8 * scale;
  const auto px = [scale](double size) { return cvRound(size * scale); };
  const cv::Rect plot(area.x + px(38), area.y + px(30), area.width - px(54), area.height - px(52));
  draw_text(image, "force (" + unit_ + ")", {area.x + px(8), area.y + px(15)}, text_px, kInk);

  const double first_s = samples_.empty() ? 0 : std::max(samples_.front().time_s, samples_.back().time_s - duration_s_);
  const auto x_of = [&](double time_s) { return plot.x + (time_s - first_s) / duration_s_ * plot.width; };
  const auto y_of = [&](double force_N) { return plot.br().y - force_N / max_N_ * plot.height; };
  for (const double tick : round_ticks(0, max_N_, static_cast<int>(plot.height / (2.5 * text_px)))) {
    const int y = cvRound(y_of(tick));
    cv::line(image, {plot.x, y}, {plot.br().x, y}, cv::Scalar::all(tick > 0 ? 90 : 190));
    draw_text(image, tick_text(tick), {plot.x - px(5), y + cvRound(text_px / 2)}, text_px, kInk, TextAnchor::right);
  }
  const std::vector<double> ticks_s = round_ticks(first_s, first_s + duration_s_, 5);
  for (const double tick : ticks_s) {
    const int x = cvRound(x_of(tick));
    cv::line(image, {x, plot.br().y}, {x, plot.br().y + px(4)}, kInk);
    draw_text(image, tick_text(tick) + (tick == ticks_s.back() ? " s" : ""), {x, plot.br().y + px(15)}, text_px, kInk,
              TextAnchor::centre);
  }

  constexpr int kFractionBits = 4;  // sub-pixel coordinates of cv::line
  const auto fixed_point = [&](const Sample& sample) {
    return cv::Point(cvRound(x_of(sample.time_s) * (1 << kFractionBits)),
                     cvRound(y_of(*sample.force_N) * (1 << kFractionBits)));
  };
  for (size_t i = 1; i < samples_.size(); ++i)
    if (samples_[i - 1].force_N && samples_[i].force_N)
      cv::line(image, fixed_point(samples_[i - 1]), fixed_point(samples_[i]), colour, std::max(1, px(2)), cv::LINE_AA,
               kFractionBits);
  if (!samples_.empty() && samples_.back().force_N)
    cv::circle(image, fixed_point(samples_.back()), px(3) << kFractionBits, kInk, cv::FILLED, cv::LINE_AA,
               kFractionBits);
}

}  // namespace palpate
