#include "palpate/contact/tissue_motion.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace palpate {

namespace {

constexpr int kMostPoints = 80;
constexpr int kWindow_px = 21;
constexpr int kLevels = 3;
constexpr double kForwardBackward_px = 0.3;
constexpr double kRows_px = 1.0;             // left row against right row, beyond what the reference showed
constexpr double kTrackDeviation_px = 0.06;  // of one Lucas-Kanade position
constexpr double kLeastCorrelation = 0.8;    // of the window with its template

/// Local mean and deviation equalised: light at the camera and the eyes' exposure change both, and Lucas-Kanade
/// compares grey levels.
cv::Mat equalised(const cv::Mat& bgr) {
  cv::Mat grey, mean, square, squared_mean, deviation;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F);
  cv::boxFilter(grey, mean, CV_32F, {41, 41});
  cv::boxFilter(grey.mul(grey), square, CV_32F, {41, 41});
  cv::max(square - mean.mul(mean), 0, squared_mean);
  cv::sqrt(squared_mean, deviation);
  cv::Mat result;
  cv::Mat((grey - mean) / (deviation + 3) * 40 + 128).convertTo(result, CV_8U);
  return result;
}

/// 255 on highlights with their halo: what is there moves with the light, not with the tissue.
cv::Mat highlights(const cv::Mat& bgr) {
  cv::Mat mask(bgr.size(), CV_8U);
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      const cv::Vec3b& p = bgr.at<cv::Vec3b>(y, x);
      const int most = std::max({p[0], p[1], p[2]}), least = std::min({p[0], p[1], p[2]});
      mask.at<uchar>(y, x) = most > 200 && least > 0.5 * most ? 255 : 0;
    }
  cv::dilate(mask, mask, cv::Mat::ones(9, 9, CV_8U));
  return mask;
}

cv::Mat grown(const cv::Mat& mask, const cv::Size& size, int by_px) {
  if (mask.empty()) return cv::Mat::zeros(size, CV_8U);
  cv::Mat result;
  cv::dilate(mask, result, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * by_px + 1, 2 * by_px + 1}));
  return result;
}

bool set_at(const cv::Mat& mask, const cv::Point2f& p) {
  const int x = cvRound(p.x), y = cvRound(p.y);
  return x < 0 || y < 0 || x >= mask.cols || y >= mask.rows || mask.at<uchar>(y, x) != 0;
}

/// One eye of one frame, cut out around the contact.
struct EyePart {
  cv::Mat grey;
  cv::Mat unusable;
};

EyePart part_of(const cv::Mat& bgr, const cv::Mat& instrument, const cv::Rect& region) {
  const cv::Mat part = bgr(region);
  EyePart eye;
  eye.grey = equalised(part);
  eye.unusable = highlights(part) | grown(instrument.empty() ? instrument : instrument(region), part.size(), 8);
  return eye;
}

struct Tracks {
  std::vector<cv::Point2f> points;
  std::vector<uchar> good;
};

double correlation(const cv::Mat& a, const cv::Point2f& pa, const cv::Mat& b, const cv::Point2f& pb) {
  cv::Mat wa, wb, result;
  cv::getRectSubPix(a, {13, 13}, pa, wa);
  cv::getRectSubPix(b, {13, 13}, pb, wb);
  cv::matchTemplate(wa, wb, result, cv::TM_CCOEFF_NORMED);
  return result.at<float>(0, 0);
}

/// From `from` to `to`, checked backwards and by correlation.
Tracks follow(const EyePart& from, const EyePart& to, const std::vector<cv::Point2f>& start,
              const std::vector<cv::Point2f>& guess) {
  Tracks tracks;
  tracks.points = guess;
  tracks.good.assign(start.size(), 0);
  if (start.empty()) return tracks;
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01);
  std::vector<uchar> forward, backward;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from.grey, to.grey, start, tracks.points, forward, error, {kWindow_px, kWindow_px}, kLevels,
                           stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  std::vector<cv::Point2f> back = start;
  cv::calcOpticalFlowPyrLK(to.grey, from.grey, tracks.points, back, backward, error, {kWindow_px, kWindow_px}, kLevels,
                           stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  for (size_t i = 0; i < start.size(); ++i) {
    const cv::Point2f miss = back[i] - start[i];
    tracks.good[i] = forward[i] && backward[i] && std::hypot(miss.x, miss.y) < kForwardBackward_px &&
                     !set_at(to.unusable, tracks.points[i]) &&
                     correlation(from.grey, start[i], to.grey, tracks.points[i]) > kLeastCorrelation;
  }
  return tracks;
}

std::vector<cv::Point2f> shifted(std::vector<cv::Point2f> points, double dx) {
  for (cv::Point2f& p : points) p.x += static_cast<float>(dx);
  return points;
}

cv::Mat ring_mask(const cv::Size& size, const cv::Point2d& center, double radius_px) {
  cv::Mat ring = cv::Mat::zeros(size, CV_8U);
  cv::circle(ring, center, cvRound(radius_px), 255, cv::FILLED);
  return ring;
}

}  // namespace

struct TissueMotion::State {
  Rectification rectification;
  bool active = false;
  cv::Rect left_region, right_region;
  EyePart left, right;                                 ///< the reference frame
  std::vector<cv::Point2f> left_points, right_points;  ///< in it, px of the regions
  std::vector<cv::Point2f> left_last, right_last;      ///< where they were last seen

  Vec3 point(const cv::Point2f& left_px, const cv::Point2f& right_px) const {
    const cv::Point2d l(left_px.x + left_region.x, left_px.y + left_region.y);
    return triangulate_pixel(rectification, l, l.x - right_px.x - right_region.x);
  }
};

TissueMotion::TissueMotion(const Rectification& rectification) : state_(std::make_unique<State>()) {
  state_->rectification = rectification;
}

TissueMotion::~TissueMotion() = default;
TissueMotion::TissueMotion(TissueMotion&&) noexcept = default;

void TissueMotion::start(const RectifiedPair& reference, const cv::Mat& instrument_mask, const Vec3& center_mm,
                         double outer_radius_mm) {
  State& s = *state_;
  stop();
  const double depth = rectified_depth_mm(s.rectification, center_mm);
  if (!(depth > 0)) return;
  const cv::Point2d center = project_to_rectified(s.rectification, center_mm);
  const double disparity = s.rectification.disparity_px(depth);
  const double radius = outer_radius_mm * s.rectification.focal_px / depth;
  // Room for what the tissue may move and for the windows of the coarsest level.
  const int half = static_cast<int>(radius) + 60;
  const cv::Rect image({}, reference.left.size());
  const cv::Rect box(cvRound(center.x) - half, cvRound(center.y) - half, 2 * half, 2 * half);
  s.left_region = box & image;
  s.right_region = (box - cv::Point(cvRound(disparity), 0)) & image;
  if (s.left_region.width < 2 * kWindow_px || s.left_region.height < 2 * kWindow_px ||
      s.right_region.width < 2 * kWindow_px)
    return;

  s.left = part_of(reference.left, instrument_mask, s.left_region);
  s.right = part_of(reference.right, {}, s.right_region);
  const cv::Point2d in_region = center - cv::Point2d(s.left_region.tl());
  const cv::Mat where = ring_mask(s.left.grey.size(), in_region, radius) & ~s.left.unusable;
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(s.left.grey, corners, kMostPoints, 0.02, 5, where, 7);
  const Tracks across =
      follow(s.left, s.right, corners, shifted(corners, s.left_region.x - s.right_region.x - disparity));
  for (size_t i = 0; i < corners.size(); ++i) {
    const double row = across.points[i].y + s.right_region.y - corners[i].y - s.left_region.y;
    const double d = corners[i].x + s.left_region.x - across.points[i].x - s.right_region.x;
    if (!across.good[i] || std::abs(row) > kRows_px || d < 0.5 * disparity || d > 2 * disparity) continue;
    s.left_points.push_back(corners[i]);
    s.right_points.push_back(across.points[i]);
  }
  s.left_last = s.left_points;
  s.right_last = s.right_points;
  s.active = !s.left_points.empty();
}

void TissueMotion::stop() {
  state_->active = false;
  state_->left_points.clear();
  state_->right_points.clear();
}

bool TissueMotion::active() const {
  return state_->active;
}

std::vector<TissuePoint> TissueMotion::update(const RectifiedPair& pair, const cv::Mat& left_instrument_mask,
                                              const cv::Mat& right_instrument_mask) {
  State& s = *state_;
  std::vector<TissuePoint> result;
  if (!s.active) return result;
  Tracks in_left, in_right;
  tbb::parallel_invoke(
      [&] {
        in_left = follow(s.left, part_of(pair.left, left_instrument_mask, s.left_region), s.left_points, s.left_last);
      },
      [&] {
        in_right =
            follow(s.right, part_of(pair.right, right_instrument_mask, s.right_region), s.right_points, s.right_last);
      });
  for (size_t i = 0; i < s.left_points.size(); ++i) {
    const double row_before = s.right_points[i].y - s.left_points[i].y;
    const double row = in_right.points[i].y - in_left.points[i].y;
    const bool seen = in_left.good[i] && in_right.good[i] && std::abs(row - row_before) < kRows_px;
    s.left_last[i] = seen ? in_left.points[i] : s.left_points[i];
    s.right_last[i] = seen ? in_right.points[i] : s.right_points[i];
    if (!seen) continue;
    TissuePoint point;
    point.number = static_cast<int>(i);
    point.rest_mm = s.point(s.left_points[i], s.right_points[i]);
    point.displacement_mm = s.point(in_left.points[i], in_right.points[i]) - point.rest_mm;
    const double z = rectified_depth_mm(s.rectification, point.rest_mm + point.displacement_mm);
    point.deviation_mm =
        z * z / (s.rectification.focal_px * s.rectification.baseline_mm) * kTrackDeviation_px * std::sqrt(2.0);
    if (point.rest_mm.allFinite() && point.displacement_mm.allFinite()) result.push_back(point);
  }
  return result;
}

}  // namespace palpate
