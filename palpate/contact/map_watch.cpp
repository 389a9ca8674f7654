#include "palpate/contact/map_watch.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace palpate {

namespace {

constexpr int kCorners = 60;
constexpr int kCornerDistance_px = 20;  // of the half-size image, as all below
constexpr int kWindow_px = 15;
constexpr int kLevels = 3;
constexpr double kForwardBackward_px = 0.4;
constexpr double kMoved_px = 1.5;
constexpr int kFewestPoints = 15;
constexpr double kStaleShare = 0.75;
/// Fewer found again: the picture shows too little, or another place.
constexpr double kLeastFoundShare = 0.3;
constexpr double kVeiledContrast = 0.6;

/// Standard deviation of what is finer than a few pixels, grey levels.
double contrast_of(const cv::Mat& grey) {
  cv::Mat smooth, fine;
  cv::GaussianBlur(grey, smooth, {}, 3);
  cv::subtract(grey, smooth, fine, {}, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(fine, mean, deviation);
  return deviation[0];
}

cv::Mat half_grey(const cv::Mat& bgr) {
  cv::Mat half, grey;
  cv::resize(bgr, half, {}, 0.5, 0.5, cv::INTER_AREA);
  cv::cvtColor(half, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

std::vector<cv::Mat> pyramid_of(const cv::Mat& bgr) {
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(half_grey(bgr), pyramid, {kWindow_px, kWindow_px}, kLevels);
  return pyramid;
}

}  // namespace

MapWatch::MapWatch(const cv::Mat& static_left, const cv::Mat& instrument) : static_pyramid_(pyramid_of(static_left)) {
  const cv::Mat grey = half_grey(static_left);
  static_contrast_ = contrast_of(grey);
  // Highlights move with the light; what is near them, too.
  cv::Mat usable = grey < 200;
  if (!instrument.empty()) {
    cv::Mat half;
    cv::resize(instrument, half, grey.size(), 0, 0, cv::INTER_NEAREST);
    usable &= half == 0;
  }
  cv::erode(usable, usable, cv::Mat::ones(9, 9, CV_8U));
  cv::goodFeaturesToTrack(grey, corners_, kCorners, 0.01, kCornerDistance_px, usable);
}

MapWatch::Answer MapWatch::update(const cv::Mat& left, const cv::Mat& instrument) const {
  Answer answer;
  if (corners_.empty()) return answer;
  const std::vector<cv::Mat> pyramid = pyramid_of(left);
  const cv::Size window(kWindow_px, kWindow_px);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 15, 0.05);
  std::vector<cv::Point2f> now, back;
  std::vector<uchar> forward, backward;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(static_pyramid_, pyramid, corners_, now, forward, error, window, kLevels, stop);
  cv::calcOpticalFlowPyrLK(pyramid, static_pyramid_, now, back, backward, error, window, kLevels, stop);
  std::vector<double> motion_px;
  int free = 0;
  for (size_t i = 0; i < corners_.size(); ++i) {
    const cv::Point2f was = 2 * corners_[i];
    if (!instrument.empty() && instrument.at<uchar>(cv::Point(was))) continue;
    ++free;
    const cv::Point at(cvRound(2 * now[i].x), cvRound(2 * now[i].y));
    const bool in_image = cv::Rect({}, left.size()).contains(at);
    if (!forward[i] || !backward[i] || !in_image || cv::norm(back[i] - corners_[i]) > kForwardBackward_px) continue;
    if (!instrument.empty() && instrument.at<uchar>(at)) continue;
    motion_px.push_back(cv::norm(now[i] - corners_[i]));
  }
  answer.points = static_cast<int>(motion_px.size());
  answer.found_share = free > 0 ? static_cast<double>(answer.points) / free : 0;
  if (free >= kFewestPoints && answer.found_share < kLeastFoundShare) {
    answer.veiled = contrast_of(half_grey(left)) < kVeiledContrast * static_contrast_;
    answer.map_is_stale = !answer.veiled;
    return answer;
  }
  if (answer.points < kFewestPoints) return answer;
  const auto moved = std::count_if(motion_px.begin(), motion_px.end(), [](double px) { return px > kMoved_px; });
  answer.moved_share = static_cast<double>(moved) / answer.points;
  const auto middle = motion_px.begin() + static_cast<std::ptrdiff_t>(motion_px.size() / 2);
  std::nth_element(motion_px.begin(), middle, motion_px.end());
  answer.median_px = 2 * *middle;
  answer.map_is_stale = answer.moved_share > kStaleShare;
  return answer;
}

}  // namespace palpate
