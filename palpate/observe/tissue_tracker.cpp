#include "palpate/observe/tissue_tracker.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

constexpr int kWindow_px = 21;
constexpr int kLevels = 2;
constexpr int kCompared_px = 13;
/// Points of each part of the picture.
constexpr int kInCell = 4;
/// Margin around an instrument: what moves with it, its shadow and the windows that reach over its edge.
constexpr int kInstrumentMargin_px = 9;

/// Grey levels with local mean and deviation equalized (statistics at a quarter of the size): light at the camera and
/// automatic exposure change both, and Lucas-Kanade compares grey levels.
cv::Mat equalized(const cv::Mat& bgr) {
  cv::Mat grey, quarter, mean, square, deviation;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  cv::resize(grey, quarter, {}, 0.25, 0.25, cv::INTER_AREA);
  quarter.convertTo(quarter, CV_32F);
  constexpr int kBox = 11;
  cv::boxFilter(quarter, mean, CV_32F, {kBox, kBox});
  cv::boxFilter(quarter.mul(quarter), square, CV_32F, {kBox, kBox});
  cv::Mat variance = cv::max(square - mean.mul(mean), 0);
  cv::sqrt(variance, deviation);
  constexpr float kContrast = 40, kFloor = 3;
  cv::Mat gain = kContrast / (deviation + kFloor);
  cv::Mat offset = 128 - mean.mul(gain);
  cv::resize(gain, gain, grey.size(), 0, 0, cv::INTER_LINEAR);
  cv::resize(offset, offset, grey.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat result(grey.size(), CV_8U);
  tbb::parallel_for(0, grey.rows, [&](int y) {
    const uchar* from = grey.ptr<uchar>(y);
    const float *g = gain.ptr<float>(y), *o = offset.ptr<float>(y);
    uchar* to = result.ptr<uchar>(y);
    for (int x = 0; x < grey.cols; ++x)
      to[x] = static_cast<uchar>(std::clamp(g[x] * static_cast<float>(from[x]) + o[x], 0.0F, 255.0F));
  });
  return result;
}

/// How much of a pixel's light is colour: 0 = white.
double saturation(const cv::Vec3b& pixel) {
  const int max = std::max({pixel[0], pixel[1], pixel[2]}), min = std::min({pixel[0], pixel[1], pixel[2]});
  return static_cast<double>(max - min) / std::max(1, max);
}

/// A highlight is bright and far whiter than the tissue: what is there moves with the light. Returns the saturation
/// below which a bright pixel is one.
double saturation_of_highlights(const cv::Mat& bgr, const cv::Mat& tissue) {
  constexpr double kRatio = 0.35;
  constexpr int kEvery_px = 4;
  std::vector<double> saturations;
  for (int y = 0; y < bgr.rows; y += kEvery_px)
    for (int x = 0; x < bgr.cols; x += kEvery_px)
      if (tissue.at<uchar>(y, x)) saturations.push_back(saturation(bgr.at<cv::Vec3b>(y, x)));
  if (saturations.empty()) return 0;
  const auto middle = median_of(saturations);
  return kRatio * middle;
}

bool is_highlight(const cv::Vec3b& pixel, double white) {
  constexpr int kBright = 200, kSaturated = 235;
  const int max = std::max({pixel[0], pixel[1], pixel[2]}), min = std::min({pixel[0], pixel[1], pixel[2]});
  return min >= kSaturated || (max > kBright && max - min < white * max);
}

/// 255 on highlights with their halo.
cv::Mat highlights(const cv::Mat& bgr, double white) {
  cv::Mat mask(bgr.size(), CV_8U);
  tbb::parallel_for(0, bgr.rows, [&](int y) {
    const auto* row = bgr.ptr<cv::Vec3b>(y);
    uchar* to = mask.ptr<uchar>(y);
    for (int x = 0; x < bgr.cols; ++x) to[x] = is_highlight(row[x], white) ? 255 : 0;
  });
  cv::dilate(mask, mask, cv::Mat::ones(5, 5, CV_8U));
  return mask;
}

cv::Mat grown(const cv::Mat& mask, int by_px) {
  if (mask.empty()) return mask;
  cv::Mat result;
  cv::dilate(mask, result, cv::Mat::ones(2 * by_px + 1, 2 * by_px + 1, CV_8U));
  return result;
}

bool set_or_outside(const cv::Mat& mask, const cv::Size& size, const cv::Point2f& p) {
  const cv::Point at(cvRound(p.x), cvRound(p.y));
  if (!cv::Rect({}, size).contains(at)) return true;
  return !mask.empty() && mask.at<uchar>(at) != 0;
}

/// More than a speckle of the window is a highlight.
bool shines(const cv::Mat& bgr, const cv::Point2f& p, double white) {
  constexpr int kMaxHighlights = 4;
  const cv::Rect window(cvRound(p.x) - kCompared_px / 2, cvRound(p.y) - kCompared_px / 2, kCompared_px, kCompared_px);
  const cv::Mat part = bgr(window & cv::Rect({}, bgr.size()));
  int count = 0;
  for (int y = 0; y < part.rows; ++y)
    for (int x = 0; x < part.cols; ++x) count += is_highlight(part.at<cv::Vec3b>(y, x), white);
  return count > kMaxHighlights;
}

double correlation(const cv::Mat& a, const cv::Point2f& pa, const cv::Mat& b, const cv::Point2f& pb) {
  cv::Mat wa, wb;
  cv::getRectSubPix(a, {kCompared_px, kCompared_px}, pa, wa, CV_32F);
  cv::getRectSubPix(b, {kCompared_px, kCompared_px}, pb, wb, CV_32F);
  wa -= cv::mean(wa);
  wb -= cv::mean(wb);
  const double scale = cv::norm(wa) * cv::norm(wb);
  return scale > 0 ? wa.dot(wb) / scale : 0;
}

/// What is unlike in two windows shifts their match in proportion.
double noise_of(double correlation, double good_correlation) {
  const auto unlike = [](double c) { return std::sqrt(1 - c * c) / c; };
  return std::max(1.0, unlike(correlation) / unlike(good_correlation));
}

std::vector<cv::Mat> pyramid_of(const cv::Mat& grey, bool with_derivatives) {
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(grey, pyramid, {kWindow_px, kWindow_px}, kLevels, with_derivatives);
  return pyramid;
}

/// The best corners of each part of the picture: tissue of weak texture is followed as well, less surely.
std::vector<cv::Point2f> spread_corners(const cv::Mat& grey, const cv::Mat& where,
                                        const TissueTrackerParameters& parameters) {
  constexpr double kMinQuality = 0.001;
  constexpr int kBlock_px = 7, kMaxCandidates = 8000;
  std::vector<cv::Point2f> candidates;
  cv::goodFeaturesToTrack(grey, candidates, kMaxCandidates, kMinQuality, parameters.spacing_px, where, kBlock_px);
  const double usable_px2 = std::max(1, cv::countNonZero(where));
  const int cell_px = std::max(1, static_cast<int>(std::sqrt(kInCell * usable_px2 / parameters.points)));
  const int columns = grey.cols / cell_px + 1;
  std::vector<int> taken(static_cast<size_t>(columns * (grey.rows / cell_px + 1)), 0);
  std::vector<cv::Point2f> chosen;
  for (const cv::Point2f& p : candidates) {  // the best ones first
    int& in_cell =
        taken[static_cast<size_t>(static_cast<int>(p.y) / cell_px * columns + static_cast<int>(p.x) / cell_px)];
    if (in_cell >= kInCell) continue;
    ++in_cell;
    chosen.push_back(p);
  }
  return chosen;
}

/// One camera in the map frame.
struct CameraReference {
  cv::Mat grey;
  std::vector<cv::Mat> pyramid;
  std::vector<cv::Point2f> points;
};

struct Tracks {
  std::vector<cv::Point2f> points;
  std::vector<uchar> found;
  std::vector<double> correlation;
};

/// From the reference into a picture, beginning at `guess`; checked by the windows' correlation.
Tracks follow(const CameraReference& reference, const std::vector<cv::Point2f>& from, const cv::Mat& bgr,
              const cv::Mat& instrument, std::vector<cv::Point2f> guess, double min_correlation, double white) {
  const cv::Mat grey = equalized(bgr);
  const std::vector<cv::Mat> pyramid = pyramid_of(grey, false);
  Tracks tracks;
  tracks.points = std::move(guess);
  std::vector<float> error;
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01);
  cv::calcOpticalFlowPyrLK(reference.pyramid, pyramid, from, tracks.points, tracks.found, error,
                           {kWindow_px, kWindow_px}, kLevels, stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  const cv::Mat covered = grown(instrument, kInstrumentMargin_px);
  tracks.correlation.assign(tracks.points.size(), 0);
  tbb::parallel_for(size_t{0}, tracks.points.size(), [&](size_t i) {
    if (!tracks.found[i] || set_or_outside(covered, grey.size(), tracks.points[i]) ||
        shines(bgr, tracks.points[i], white)) {
      tracks.found[i] = 0;
      return;
    }
    tracks.correlation[i] = correlation(reference.grey, from[i], grey, tracks.points[i]);
    tracks.found[i] = tracks.correlation[i] > min_correlation;
  });
  return tracks;
}

}  // namespace

struct TissueTracker::State {
  TissueTrackerParameters parameters;
  CameraReference left, right;
  double white = 0;  ///< saturation of highlights
  std::vector<TissuePoint> points;
};

TissueTracker::TissueTracker(const RectifiedPair& reference, const Rectification& rectification,
                             const cv::Mat& disparity_px, const cv::Mat& usable,
                             const TissueTrackerParameters& parameters)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.parameters = parameters;
  s.left.grey = equalized(reference.left);
  s.right.grey = equalized(reference.right);
  s.white = saturation_of_highlights(reference.left, usable);
  s.left.pyramid = pyramid_of(s.left.grey, true);
  s.right.pyramid = pyramid_of(s.right.grey, true);
  cv::Mat where = usable & (disparity_px == disparity_px) & ~highlights(reference.left, s.white);
  cv::erode(where, where, cv::Mat::ones(kCompared_px, kCompared_px, CV_8U));
  const std::vector<cv::Point2f> corners = spread_corners(s.left.grey, where, parameters);
  if (corners.empty()) return;

  std::vector<cv::Point2f> guess = corners;
  for (cv::Point2f& p : guess) p.x -= disparity_px.at<float>(cvRound(p.y), cvRound(p.x));
  const std::vector<cv::Point2f> expected = guess;
  const Tracks matched = follow(s.left, corners, reference.right, {}, guess, parameters.min_correlation, s.white);
  for (size_t i = 0; i < corners.size(); ++i) {
    constexpr float kAgreement_px = 1;
    const cv::Point2f miss = matched.points[i] - expected[i];
    if (!matched.found[i] || std::hypot(miss.x, miss.y) > 2 * kAgreement_px || std::abs(miss.x) > kAgreement_px)
      continue;
    TissuePoint point;
    point.number = static_cast<int>(s.points.size());
    point.rest_mm = triangulate_pixel(rectification, corners[i], corners[i].x - expected[i].x);
    s.points.push_back(point);
    s.left.points.push_back(corners[i]);
    s.right.points.push_back(matched.points[i]);
  }
}

TissueTracker::~TissueTracker() = default;
TissueTracker::TissueTracker(TissueTracker&&) noexcept = default;

const std::vector<TissuePoint>& TissueTracker::points() const {
  return state_->points;
}

std::vector<TissuePoint> TissueTracker::update(const RectifiedPair& pair, const cv::Mat& left_instrument,
                                               const cv::Mat& right_instrument,
                                               const std::vector<TissuePoint>& wanted) const {
  const State& s = *state_;
  std::vector<TissuePoint> seen;
  if (wanted.empty() || pair.left.empty() || pair.right.empty()) return seen;
  std::vector<cv::Point2f> left_from, right_from, left_guess, right_guess;
  for (const TissuePoint& point : wanted) {
    const cv::Point2f motion(static_cast<float>(point.motion_px.x()), static_cast<float>(point.motion_px.y()));
    left_from.push_back(s.left.points[static_cast<size_t>(point.number)]);
    right_from.push_back(s.right.points[static_cast<size_t>(point.number)]);
    left_guess.push_back(left_from.back() + motion);
    right_guess.push_back(right_from.back() + motion - cv::Point2f(static_cast<float>(point.motion_px.z()), 0));
  }
  Tracks left, right;
  const double min_correlation = s.parameters.min_correlation;
  tbb::parallel_invoke(
      [&] { left = follow(s.left, left_from, pair.left, left_instrument, left_guess, min_correlation, s.white); },
      [&] {
        right = follow(s.right, right_from, pair.right, right_instrument, right_guess, min_correlation, s.white);
      });
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (!left.found[i] || !right.found[i]) continue;
    const cv::Point2f left_motion = left.points[i] - left_from[i], right_motion = right.points[i] - right_from[i];
    if (std::abs(right_motion.y - left_motion.y) > s.parameters.max_row_change_px) continue;
    TissuePoint point = wanted[i];
    point.motion_px = Vec3(left_motion.x, left_motion.y, left_motion.x - right_motion.x);
    point.noise = noise_of(std::min(left.correlation[i], right.correlation[i]), s.parameters.good_correlation);
    seen.push_back(point);
  }
  return seen;
}

}  // namespace palpate
