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

constexpr int kLeastSeeds = 8;
constexpr double kWarnedRowOffset_px = 0.5;

// Left and right are swapped when many more corners are found again behind infinity than in front of it.
void check_seeds(const Eyes& eyes, const Seeds& seeds, double least, double most) {
  const int found = static_cast<int>(seeds.matches.size());
  if (2 * found < seeds.corners) {
    const int mirrored = static_cast<int>(find_seeds(eyes, -most, -least).matches.size());
    if (mirrored >= kLeastSeeds && mirrored > 2 * found)
      throw BadInput(fmt::format(
          "left and right look swapped: {} points match with negative disparity and {} with positive, expected only "
          "positive; set recording.swap: true",
          mirrored, found));
  }
  if (found < kLeastSeeds)
    throw BadInput(fmt::format(
        "the image shows too little texture to match: {} points of the left image were found in the right one, "
        "expected "
        "at least {} (is the organ region on the organ, does the calibration belong to this recording, is the depth "
        "between map.nearest_mm and map.farthest_mm?)",
        found, kLeastSeeds));
}

cv::Mat eight_bit(const cv::Mat& grey) {
  cv::Mat result;
  grey.convertTo(result, CV_8U);
  return result;
}

cv::Mat disparity_by_sgbm(const Eyes& eyes, double least, double most) {
  const int first = cvFloor(least);
  const int count = (cvCeil(most) - first + 16) / 16 * 16;
  constexpr int kBlock = 5;
  const auto matcher = cv::StereoSGBM::create(first, count, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 31, 5,
                                              100, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat sixteenths, disparity;
  matcher->compute(eight_bit(eyes.left), eight_bit(eyes.right), sixteenths);
  sixteenths.convertTo(disparity, CV_32F, 1.0 / 16);
  disparity.setTo(std::numeric_limits<float>::quiet_NaN(), sixteenths < 16 * first);
  return disparity;
}

cv::Mat disparity_by_dis(const Eyes& eyes, double least, double most) {
  const cv::Mat left = eight_bit(eyes.left), right = eight_bit(eyes.right);
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
      if (-there[0] < least || -there[0] > most || !image.contains(at)) continue;
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
  const double least = rectification.disparity_px(options.farthest_mm);
  const double most = rectification.disparity_px(options.nearest_mm);
  Eyes eyes = prepare_eyes(pair.left, pair.right, mask);
  eyes.left_mask &= rectification.valid_left;
  eyes.wanted &= rectification.valid_left;
  eyes.right_mask &= rectification.valid_right;
  const Seeds seeds = find_seeds(eyes, least, most);
  check_seeds(eyes, seeds, least, most);
  align_rows(eyes, seeds.row_offset_px);
  DisparityMap map;
  switch (options.matcher) {
    case Matcher::quasi_dense:
      map = match_quasi_dense(eyes, seeds, least, most);
      break;
    case Matcher::sgbm:
      map = measure(eyes, disparity_by_sgbm(eyes, least, most));
      break;
    case Matcher::dis:
      map = measure(eyes, disparity_by_dis(eyes, least, most));
      break;
    case Matcher::network:
      map = measure(eyes,
                    disparity_by_network(pair.left, rows_aligned(pair.right, seeds.row_offset_px), options.network));
      break;
  }
  take_over(seeds, map);
  return map;
}

}  // namespace palpate
