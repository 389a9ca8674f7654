#include "palpate/feedback/draw.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
/// Capital letters of the Hershey simplex font are 21 px tall at size 1.
constexpr double kCapitalHeight_px = 21;

int stroke(double height_px, bool bold) {
  return std::max(1, static_cast<int>(std::lround(height_px * (bold ? 0.17 : 0.09))));
}

cv::Point anchored(const std::string& text, cv::Point origin, double height_px, TextAnchor anchor, bool bold) {
  if (anchor == TextAnchor::centre) origin.x -= text_width(text, height_px, bold) / 2;
  if (anchor == TextAnchor::right) origin.x -= text_width(text, height_px, bold);
  return origin;
}

}  // namespace

double drawing_scale(const cv::Size& image_size) {
  return std::clamp(std::min(image_size.height / 540.0, image_size.width / 960.0), 0.6, 4.0);
}

int text_width(const std::string& text, double height_px, bool bold) {
  int below = 0;
  return cv::getTextSize(text, kFont, height_px / kCapitalHeight_px, stroke(height_px, bold), &below).width;
}

void draw_text(cv::Mat& image, const std::string& text, cv::Point origin, double height_px, const cv::Scalar& colour,
               TextAnchor anchor, bool bold) {
  cv::putText(image, text, anchored(text, origin, height_px, anchor, bold), kFont, height_px / kCapitalHeight_px,
              colour, stroke(height_px, bold), cv::LINE_AA);
}

void draw_rimmed_text(cv::Mat& image, const std::string& text, cv::Point origin, double height_px,
                      const cv::Scalar& colour, TextAnchor anchor) {
  origin = anchored(text, origin, height_px, anchor, true);
  const int width = stroke(height_px, true);
  cv::putText(image, text, origin, kFont, height_px / kCapitalHeight_px, cv::Scalar::all(15), width + 3, cv::LINE_AA);
  cv::putText(image, text, origin, kFont, height_px / kCapitalHeight_px, colour, width, cv::LINE_AA);
}

void draw_veil(cv::Mat& image, const cv::Rect& area, double darkness) {
  const cv::Rect inside = area & cv::Rect(0, 0, image.cols, image.rows);
  if (inside.empty()) return;
  cv::Mat part = image(inside);
  part.convertTo(part, -1, 1 - darkness);
}

}  // namespace palpate
