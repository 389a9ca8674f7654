#include "palpate/instrument/still_parts.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr double kMoves = 0.02;    // of the image's width, by which tissue moves
constexpr double kAtRest = 0.9;    // fraction of an end that shows as before
constexpr double kUnchanged = 24;  // grey levels

}  // namespace

StillParts::StillParts(const cv::Mat& static_bgr, const cv::Mat& mask) {
  if (cv::countNonZero(mask) == 0) return;
  const int reach_px = static_cast<int>(std::ceil(kMoves * mask.cols));
  const cv::Mat around = cv::Mat::ones(2 * reach_px + 1, 2 * reach_px + 1, CV_8U);
  cv::Mat darkest(static_bgr.size(), CV_8UC3, cv::Scalar::all(255));
  cv::Mat brightest = cv::Mat::zeros(static_bgr.size(), CV_8UC3);
  static_bgr.copyTo(darkest, mask);
  static_bgr.copyTo(brightest, mask);
  cv::erode(darkest, darkest_, around);
  cv::dilate(brightest, brightest_, around);
  cv::dilate(mask, nearby_, around);
}

cv::Mat StillParts::in(const cv::Mat& bgr) const {
  if (darkest_.empty()) return {};
  cv::Mat small = bgr, same;
  if (bgr.size() != darkest_.size()) cv::resize(bgr, small, darkest_.size(), 0, 0, cv::INTER_AREA);
  cv::inRange(small, darkest_ - cv::Scalar::all(kUnchanged), brightest_ + cv::Scalar::all(kUnchanged), same);
  return same & nearby_;
}

cv::Mat StillParts::left_out_of(const cv::Mat& mask, const cv::Mat& bgr, const cv::Mat& picture_area) const {
  if (darkest_.empty()) return mask;
  const cv::Mat same = in(bgr);
  cv::Mat labels, result = mask.clone();
  const int count = cv::connectedComponents(mask, labels, 8);
  for (int i = 1; i < count; ++i) {
    const cv::Mat part = labels == i;
    if (cv::countNonZero(part & same) > 0 && find_instruments(part, picture_area, 1).empty())
      result.setTo(0, part & same);
  }
  return result;
}

bool rests(const ImageInstrument& instrument, cv::Size image, const cv::Mat& still) {
  if (still.empty()) return false;
  cv::Mat end = cv::Mat::zeros(image, CV_8U), near_tip = cv::Mat::zeros(image, CV_8U), small;
  instrument.mask.copyTo(end(instrument.box));
  const double pixel_of_still = static_cast<double>(image.width) / still.cols;
  const int radius_px = static_cast<int>(std::max(pixel_of_still, instrument.tip.width_px));
  cv::circle(near_tip, instrument.tip.tip_px, radius_px, 255, cv::FILLED);
  cv::resize(end & near_tip, small, still.size(), 0, 0, cv::INTER_NEAREST);
  return cv::countNonZero(small & still) >= kAtRest * std::max(1, cv::countNonZero(small));
}

}  // namespace palpate
