#include "palpate/feedback/colour_map.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/feedback/axis.h"
#include "palpate/feedback/draw.h"

namespace palpate {

ColourTable colour_table(ColourMap map) {
  cv::Mat grey(1, 256, CV_8U), colours;
  for (int i = 0; i < 256; ++i) grey.at<uchar>(0, i) = static_cast<uchar>(i);
  cv::applyColorMap(grey, colours, map == ColourMap::jet ? cv::COLORMAP_JET : cv::COLORMAP_VIRIDIS);
  ColourTable table;
  for (int i = 0; i < 256; ++i) table[static_cast<size_t>(i)] = colours.at<cv::Vec3b>(0, i);
  return table;
}

cv::Vec3b colour_at(const ColourTable& table, double fraction) {
  return table[static_cast<size_t>(std::lround(255 * std::clamp(fraction, 0.0, 1.0)))];
}

void draw_colour_bar(cv::Mat& image, const cv::Rect& area, const ColourTable& table, const ColourBar& bar,
                     double scale) {
  draw_veil(image, area);
  const double text_px = 9 * scale;
  const int gap = cvRound(8 * scale);
  draw_text(image, bar.title, {area.x + gap, area.y + gap + cvRound(text_px)}, text_px, kInk);

  draw_text(image, bar.note, {area.x + gap, area.br().y - gap}, text_px, kFaintInk);
  const int note_px = bar.note.empty() ? 0 : cvRound(text_px) + gap;
  const int top = area.y + 3 * gap + cvRound(text_px), bottom = area.br().y - 2 * gap - note_px;
  const cv::Rect strip(area.x + gap, top, cvRound(14 * scale), bottom - top);
  for (int y = strip.y; y < strip.br().y; ++y) {
    const cv::Vec3b colour = colour_at(table, (bottom - 1 - y) / std::max(1.0, strip.height - 1.0));
    cv::line(image, {strip.x, y}, {strip.br().x - 1, y}, colour);
  }
  for (const double tick : round_ticks(bar.min, bar.max, 5)) {
    const int y = cvRound(bottom - 1 - (tick - bar.min) / (bar.max - bar.min) * (strip.height - 1));
    cv::line(image, {strip.br().x, y}, {strip.br().x + gap / 2, y}, kInk);
    draw_text(image, tick_text(tick), {strip.br().x + gap, y + cvRound(text_px / 2)}, text_px, kInk);
  }
}

}  // namespace palpate
