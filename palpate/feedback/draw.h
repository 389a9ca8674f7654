#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace palpate {

enum class TextAnchor { left, centre, right };

/// Colours (BGR) that everything drawn on an image shares.
inline const cv::Scalar kInk{245, 245, 245};
inline const cv::Scalar kFaintInk{190, 190, 190};

/// Size of text and lines for an image: 1 at 540 rows, never so small that text cannot be read.
double drawing_scale(const cv::Size& image_size);

/// Anti-aliased text, `height_px` tall (capital letters), its baseline at `origin`.
void draw_text(cv::Mat& image, const std::string& text, cv::Point origin, double height_px, const cv::Scalar& colour,
               TextAnchor anchor = TextAnchor::left, bool bold = false);

/// The same with a dark rim, to be read on any background.
void draw_rimmed_text(cv::Mat& image, const std::string& text, cv::Point origin, double height_px,
                      const cv::Scalar& colour, TextAnchor anchor = TextAnchor::left);

/// Width of the text, px.
int text_width(const std::string& text, double height_px, bool bold = false);

/// Darkens a rectangle so that text can be read on it; what lies outside the image is left out.
void draw_veil(cv::Mat& image, const cv::Rect& area, double darkness = 0.6);

}  // namespace palpate
