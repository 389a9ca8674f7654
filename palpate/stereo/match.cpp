#include "palpate/stereo/match.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "palpate/core/errors.h"
#include "palpate/stereo/network.h"
#include "palpate/stereo/quasi_dense.h"
#include "palpate/stereo/refine.h"
#include "palpate/stereo/seeds.h"

namespace palpate {
namespace {

constexpr int kMinSeeds = 8;
constexpr double kWarnedRowOffset_px = 0.5;

// Left and right are swapped when many more corners are found again behind infinity than in front of it.
void check_seeds(const PreparedPair& prepared, const Seeds& seeds, double min, double max) {
  const int found = static_cast<int>(seeds.matches.size());
  if (2 * found < seeds.corners) {
    const int mirrored = static_cast<int>(find_seeds(prepared, -max, -min).matches.size());
    if (mirrored >= kMinSeeds && mirrored > 2 * found)
      throw BadInput(fmt::format(
          "left and right look swapped: {} points match with negative disparity and {} with positive, expected only "
          "positive; set recording.swap: true",
          mirrored, found));
  }
  if (found < kMinSeeds)
    throw BadInput(fmt::format(
        "the image shows too little texture to match: {} points of the left image were found in the right one, "
        "expected "
        "at least {} (is the organ region on the organ, does the calibration belong to this recording, is the depth "
        "between map.nearest_mm and map.farthest_mm?)",
        found, kMinSeeds));
}

cv::Mat eight_bit(const cv::Mat& grey) {
  cv::Mat result;
  grey.convertTo(result, CV_8U);
  return result;
}

cv::Mat disparity_by_sgbm(const PreparedPair& prepared, double min, double max) {
  const int first = cvFloor(min);
  const int count = (cvCeil(max) - first + 16) / 16 * 16;
  constexpr int kBlock = 5;
  const auto matcher = cv::StereoSGBM::create(first, count, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 31, 5,
                                              100, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat sixteenths, disparity;
  matcher->compute(eight_bit(prepared.left), eight_bit(prepared.right), sixteenths);
  sixteenths.convertTo(disparity, CV_32F, 1.0 / 16);
  disparity.setTo(std::numeric_limits<float>::quiet_NaN(), sixteenths < 16 * first);
  return disparity;
}

cv::Mat disparity_by_dis(const PreparedPair& prepared, double min, double max) {
  const cv::Mat left = eight_bit(prepared.left), right = eight_bit(prepared.right);
  const auto flow = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
  cv::Mat forth, back;
  flow->calc(left, right, forth);
  flow->calc(right, left, back);
  cv::Mat disparity(left.size(), CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  const cv::Rect image({0, 0}, left.size());
  for (int y = 0; y < left.rows; ++y)
    for (int x = 0; x < left.cols; ++x) {
      const cv::Vec2f there = forth.at<cv::Vec2f>(y, x);
      const cv::Point at(cvRound(static_cast<float>(x) + there[0]), cvRound(static_cast<float>(y) + there[1]));
      if (-there[0] < min || -there[0] > max || !image.contains(at)) continue;
      if (cv::norm(there + back.at<cv::Vec2f>(at)) < 1) disparity.at<float>(y, x) = -there[0];
    }
  return disparity;
}

// What the seeds say about the calibration.
void take_over(const Seeds& seeds, DisparityMap& map) {
  map.row_offset_px = seeds.row_offset_px;
  map.calibration_deviation_px = seeds.calibration_deviation_px;
  const double square = seeds.calibration_deviation_px * seeds.calibration_deviation_px;
  cv::Mat squares = map.deviation_px.mul(map.deviation_px) + square;
  cv::sqrt(squares, map.deviation_px);
  if (std::abs(seeds.row_offset_px) > kWarnedRowOffset_px)
    map.warnings.push_back(fmt::format(
        "the rows of left and right do not match: the right image lies {:.1f} px {}; this was corrected, but the "
        "calibration is off by about as much along the row, where it cannot be seen; calibrate again",
        std::abs(seeds.row_offset_px), seeds.row_offset_px > 0 ? "lower" : "higher"));
}

}  // namespace

void describe(Settings& settings, MatchOptions& options) {
  settings.choice_or_file<Matcher>(
      "matcher", options.matcher,
      {{"quasi-dense", Matcher::quasi_dense}, {"sgbm", Matcher::sgbm}, {"dis", Matcher::dis}}, Matcher::network,
      ".onnx", options.network,
      "how left and right are matched; a file: learned network, inputs left and right, output disparity");
  settings.number("nearest_mm", options.nearest_mm, {1, 10000, false, false}, "closest depth searched");
  settings.number("farthest_mm", options.farthest_mm, {1, 100000, false, false}, "farthest depth searched");
  settings.after_reading([&options] {
    if (options.nearest_mm >= options.farthest_mm)
      throw BadInput(fmt::format("map.nearest_mm is {:g} and map.farthest_mm is {:g}, expected nearest below farthest",
                                 options.nearest_mm, options.farthest_mm));
  });
}

DisparityMap match(const RectifiedPair& pair, const Rectification& rectification, const cv::Mat& mask,
                   const MatchOptions& options) {
  const double min = rectification.disparity_px(options.farthest_mm);
  const double max = rectification.disparity_px(options.nearest_mm);
  PreparedPair prepared = prepare_pair(pair.left, pair.right, mask);
  prepared.left_mask &= rectification.valid_left;
  prepared.wanted &= rectification.valid_left;
  prepared.right_mask &= rectification.valid_right;
  const Seeds seeds = find_seeds(prepared, min, max);
  check_seeds(prepared, seeds, min, max);
  align_rows(prepared, seeds.row_offset_px);
  DisparityMap map;
  switch (options.matcher) {
    case Matcher::quasi_dense:
      map = match_quasi_dense(prepared, seeds, min, max);
      break;
    case Matcher::sgbm:
      map = measure(prepared, disparity_by_sgbm(prepared, min, max));
      break;
    case Matcher::dis:
      map = measure(prepared, disparity_by_dis(prepared, min, max));
      break;
    case Matcher::network:
      map = measure(prepared,
                    disparity_by_network(pair.left, rows_aligned(pair.right, seeds.row_offset_px), options.network));
      break;
  }
  take_over(seeds, map);
  return map;
}

}  // namespace palpate
