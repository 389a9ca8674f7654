#include "palpate/stereo/seeds.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "palpate/core/quantile.h"

namespace palpate {
namespace {

constexpr int kMaxCorners = 600;
constexpr int kCoarse = 4;        // the search along the row works on images this many times smaller
constexpr int kCoarseRadius = 4;  // of its windows
constexpr float kMaxReturn_px = 0.5f;
constexpr float kMaxRowOffset_px = 3.0f;
constexpr float kMaxRowScatter_px = 1.0f;

std::vector<cv::Point2f> corners_of(const cv::Mat& grey, const cv::Mat& mask) {
  cv::Mat half, half_mask;
  cv::resize(grey, half, {}, 0.5, 0.5, cv::INTER_AREA);
  cv::resize(mask, half_mask, half.size(), 0, 0, cv::INTER_NEAREST);
  const double spacing = std::max(4.0, std::sqrt(cv::countNonZero(half_mask) / (1.5 * kMaxCorners)));
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(half, corners, kMaxCorners, 0.002, spacing, half_mask, 5);
  for (cv::Point2f& corner : corners) corner = 2 * corner + cv::Point2f(0.5f, 0.5f);
  return corners;
}

// ZNCC of two square windows whose centres lie inside both images by at least the radius.
float correlation(const cv::Mat& left, cv::Point at, const cv::Mat& right, cv::Point there) {
  constexpr int r = kCoarseRadius;
  constexpr float n = (2 * r + 1) * (2 * r + 1);
  float l = 0, ll = 0, m = 0, mm = 0, lm = 0;
  for (int v = -r; v <= r; ++v) {
    const float* a = left.ptr<float>(at.y + v) + at.x;
    const float* b = right.ptr<float>(there.y + v) + there.x;
    for (int u = -r; u <= r; ++u) {
      l += a[u], ll += a[u] * a[u];
      m += b[u], mm += b[u] * b[u];
      lm += a[u] * b[u];
    }
  }
  const float variances = (ll - l * l / n) * (mm - m * m / n);
  return variances > 1e-3f ? (lm - l * m / n) / std::sqrt(variances) : 0;
}

// Where each corner is best found along its row, roughly.
std::vector<cv::Point2f> coarse_search(const PreparedPair& prepared, const std::vector<cv::Point2f>& corners,
                                       double min, double max) {
  cv::Mat left, right;
  cv::resize(prepared.left, left, {}, 1.0 / kCoarse, 1.0 / kCoarse, cv::INTER_AREA);
  cv::resize(prepared.right, right, left.size(), 0, 0, cv::INTER_AREA);
  const cv::Rect inside(kCoarseRadius, kCoarseRadius, left.cols - 2 * kCoarseRadius, left.rows - 2 * kCoarseRadius);
  std::vector<cv::Point2f> found = corners;
  for (cv::Point2f& corner : found) {
    const cv::Point at(static_cast<int>(corner.x / kCoarse), static_cast<int>(corner.y / kCoarse));
    if (!inside.contains(at)) continue;
    float best = -1;
    int best_shift = 0;
    for (int shift = cvFloor(min / kCoarse); shift <= cvCeil(max / kCoarse); ++shift) {
      const cv::Point there(at.x - shift, at.y);
      if (!inside.contains(there)) continue;
      const float score = correlation(left, at, right, there);
      if (score > best) best = score, best_shift = shift;
    }
    corner.x -= static_cast<float>(kCoarse * best_shift);
  }
  return found;
}

// How far the rows' offset wanders over the image, px: medians over neighbouring seeds scatter more than the noise of
// single seeds explains.
double wandering(const std::vector<Seed>& seeds, const std::vector<float>& rows, double offset) {
  constexpr size_t kGroup = 9;
  // Deviation of a median of nine, of one's; with the margin by which some fifty groups scatter by chance.
  constexpr double kToDeviation = 1.4826, kMedianOfGroup = 0.42 * 1.3;
  if (seeds.size() < 2 * kGroup) return 0;
  std::vector<float> about_all, about_group;
  for (size_t i = 0; i < seeds.size(); ++i) {
    std::vector<std::pair<float, float>> others;  // square of the distance, row
    for (size_t k = 0; k < seeds.size(); ++k) {
      const cv::Point2f apart = seeds[k].left_px - seeds[i].left_px;
      others.emplace_back(apart.dot(apart), rows[k]);
    }
    std::nth_element(others.begin(), others.begin() + kGroup, others.end());
    std::vector<float> group;
    for (size_t k = 0; k < kGroup; ++k) group.push_back(others[k].second);
    const float middle = static_cast<float>(median_of(group));
    about_all.push_back(std::abs(middle - static_cast<float>(offset)));
    about_group.push_back(std::abs(rows[i] - middle));
  }
  const double wander = kToDeviation * median_of(about_all),
               noise = kToDeviation * kMedianOfGroup * median_of(about_group);
  return std::sqrt(std::max(0.0, wander * wander - noise * noise));
}

}  // namespace

Seeds find_seeds(const PreparedPair& prepared, double min_disparity_px, double max_disparity_px) {
  Seeds seeds;
  cv::Mat left, right;
  prepared.left.convertTo(left, CV_8U);
  prepared.right.convertTo(right, CV_8U);
  const std::vector<cv::Point2f> corners = corners_of(left, prepared.left_mask);
  seeds.corners = static_cast<int>(corners.size());
  if (corners.empty()) return seeds;

  std::vector<cv::Point2f> there = coarse_search(prepared, corners, min_disparity_px, max_disparity_px);
  std::vector<cv::Point2f> back = corners;
  std::vector<uchar> found, found_back;
  std::vector<float> error;
  const cv::Size window(21, 21);
  constexpr int kLevels = 2;
  std::vector<cv::Mat> left_pyramid, right_pyramid;
  cv::buildOpticalFlowPyramid(left, left_pyramid, window, kLevels);
  cv::buildOpticalFlowPyramid(right, right_pyramid, window, kLevels);
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 15, 0.02);
  cv::calcOpticalFlowPyrLK(left_pyramid, right_pyramid, corners, there, found, error, window, kLevels, until,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  cv::calcOpticalFlowPyrLK(right_pyramid, left_pyramid, there, back, found_back, error, window, kLevels, until,
                           cv::OPTFLOW_USE_INITIAL_FLOW);

  const cv::Rect image({0, 0}, left.size());
  std::vector<size_t> kept;
  std::vector<float> rows;
  for (size_t i = 0; i < corners.size(); ++i) {
    const float disparity = corners[i].x - there[i].x;
    if (!found[i] || !found_back[i] || !image.contains(there[i]) || !prepared.right_mask.at<uchar>(there[i])) continue;
    if (cv::norm(back[i] - corners[i]) > kMaxReturn_px) continue;
    if (disparity < min_disparity_px || disparity > max_disparity_px) continue;
    if (std::abs(there[i].y - corners[i].y) > kMaxRowOffset_px) continue;
    kept.push_back(i);
    rows.push_back(there[i].y - corners[i].y);
  }
  seeds.row_offset_px = median_of(rows);
  std::vector<float> rows_of_matches;
  for (size_t k = 0; k < kept.size(); ++k) {
    if (std::abs(rows[k] - static_cast<float>(seeds.row_offset_px)) >= kMaxRowScatter_px) continue;
    seeds.matches.push_back({corners[kept[k]], corners[kept[k]].x - there[kept[k]].x});
    rows_of_matches.push_back(rows[k]);
  }
  seeds.calibration_deviation_px =
      std::hypot(seeds.row_offset_px / std::sqrt(2), wandering(seeds.matches, rows_of_matches, seeds.row_offset_px));
  return seeds;
}

}  // namespace palpate
