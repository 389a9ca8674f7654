#include "palpate/stereo/fuse.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "palpate/stereo/recording.h"
#include "tests/stereo/files.h"
#include "tests/stereo/truth_cases.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

using test::sentence_of;
using testing::HasSubstr;

constexpr int kWidth = 200, kHeight = 120;
const cv::Rect kPassing(20, 30, 40, 40);     // something passes here in two of nine frames
const cv::Rect kBreathing(120, 30, 40, 40);  // and here the tissue moves

double truth(int x, int y) {
  return 30 + 0.05 * x + 0.01 * y;
}

// Nine frames with independent noise about a plane, all of them off by `shift` that the calibration explains.
std::vector<DisparityMap> nine_frames(double noise, double shift) {
  cv::RNG random(3);
  std::vector<DisparityMap> frames(9);
  for (int k = 0; k < 9; ++k) {
    DisparityMap& map = frames[static_cast<size_t>(k)];
    map.disparity_px = cv::Mat(kHeight, kWidth, CV_32F);
    map.deviation_px = cv::Mat(kHeight, kWidth, CV_32F, cv::Scalar(std::hypot(noise, shift)));
    map.correlation = cv::Mat(kHeight, kWidth, CV_32F, cv::Scalar(0.9));
    map.calibration_deviation_px = shift;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        double d = truth(x, y) + random.gaussian(noise) + shift;
        if (kPassing.contains({x, y}) && k < 2) d += 10;
        if (kBreathing.contains({x, y})) d += 0.5 * k;
        map.disparity_px.at<float>(y, x) = static_cast<float>(d);
      }
  }
  return frames;
}

struct Errors {
  double rms = 0, stated = 0;  // over what stands still
};

Errors errors_of(const DisparityMap& map) {
  Errors errors;
  int count = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (kBreathing.contains({x, y}) || kPassing.contains({x, y})) continue;
      const float d = map.disparity_px.at<float>(y, x);
      if (std::isnan(d)) continue;
      errors.rms += std::pow(d - truth(x, y), 2);
      errors.stated += std::pow(map.deviation_px.at<float>(y, x), 2);
      ++count;
    }
  EXPECT_GT(count, 0.98 * (kWidth * kHeight - kBreathing.area() - kPassing.area()));
  return {std::sqrt(errors.rms / count), std::sqrt(errors.stated / count)};
}

TEST(Fuse, NineFramesMoreThanHalveTheNoiseAndSaySo) {
  const std::vector<DisparityMap> frames = nine_frames(0.1, 0);
  const Errors one = errors_of(frames[0]), nine = errors_of(fuse(frames));
  EXPECT_LT(nine.rms, 0.45 * one.rms);
  EXPECT_LT(nine.stated, 0.75 * one.stated);
  EXPECT_GT(nine.stated, 0.9 * nine.rms);
}

TEST(Fuse, WhatAllFramesShareRemainsInTheDeviation) {
  const Errors nine = errors_of(fuse(nine_frames(0.1, 0.3)));
  EXPECT_NEAR(nine.rms, 0.3, 0.02);
  EXPECT_NEAR(nine.stated, 0.3, 0.03);
}

TEST(Fuse, SeesThroughWhatPassesAndLeavesOutWhatMoves) {
  const DisparityMap map = fuse(nine_frames(0.1, 0));
  for (const cv::Point at : {cv::Point(25, 35), cv::Point(40, 50), cv::Point(55, 65)})
    EXPECT_NEAR(map.disparity_px.at<float>(at), truth(at.x, at.y), 0.2);
  int measured = 0;
  for (int y = kBreathing.y; y < kBreathing.br().y; ++y)
    for (int x = kBreathing.x; x < kBreathing.br().x; ++x) measured += !std::isnan(map.disparity_px.at<float>(y, x));
  EXPECT_LT(measured, kBreathing.area() / 20);
}

TEST(Fuse, APixelMeasuredInFewerThanHalfOfTheFramesStaysEmpty) {
  std::vector<DisparityMap> frames = nine_frames(0.1, 0);
  for (size_t k = 0; k < 5; ++k) frames[k].disparity_px.at<float>(100, 100) = std::numeric_limits<float>::quiet_NaN();
  for (size_t k = 0; k < 4; ++k) frames[k].disparity_px.at<float>(100, 90) = std::numeric_limits<float>::quiet_NaN();
  const DisparityMap map = fuse(frames);
  EXPECT_TRUE(std::isnan(map.disparity_px.at<float>(100, 100)));
  EXPECT_FALSE(std::isnan(map.disparity_px.at<float>(100, 90)));
}

TEST(Fuse, OneFrameIsItself) {
  const std::vector<DisparityMap> frames = nine_frames(0.1, 0);
  const DisparityMap map = fuse({frames[0]});
  EXPECT_EQ(cv::norm(map.disparity_px, frames[0].disparity_px, cv::NORM_INF), 0);
  EXPECT_LT(cv::norm(map.deviation_px, frames[0].deviation_px, cv::NORM_INF), 1e-6);
}

TEST(Fuse, RefusesNoFrameAndFramesOfDifferentSize) {
  EXPECT_THAT(sentence_of([] { fuse({}); }), HasSubstr("at least one"));
  std::vector<DisparityMap> frames = nine_frames(0.1, 0);
  frames[3].disparity_px = cv::Mat(10, 10, CV_32F);
  EXPECT_THAT(sentence_of([&] { fuse(frames); }), HasSubstr("10x10"));
}

TEST(Fuse, TheFirstFramesOfARenderedOrganComeCloserToTheTruthTogether) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  const test::TruthCase c = test::read_truth_case("rendered_uterus");
  RecordingOptions options;
  options.left = test::reference_data() / "rendered_uterus/left.mp4";
  options.right = test::reference_data() / "rendered_uterus/right.mp4";
  options.calibration = test::reference_data() / "rendered_uterus/calibration.yaml";
  Recording recording(options);
  std::vector<DisparityMap> frames;
  for (int k = 0; k < 7; ++k)
    frames.push_back(match(rectify(c.rectification, *recording.next()), c.rectification,
                           cv::Mat(recording.size(), CV_8U, cv::Scalar(255)), c.options));
  const DisparityMap map = fuse(frames);
  const test::MatchScore one = score(frames[0], c), seven = score(map, c);
  EXPECT_LT(seven.median_px, 0.85 * one.median_px);
  EXPECT_GT(seven.covered, one.covered - 0.01);
  EXPECT_GT(seven.within_one_deviation, 0.58);
  EXPECT_LT(seven.within_one_deviation, 0.80);
  const cv::Mat both = c.scored & (frames[0].deviation_px < 0.1) & (map.deviation_px < 0.1);
  EXPECT_LT(cv::mean(map.deviation_px, both)[0], 0.9 * cv::mean(frames[0].deviation_px, both)[0]);
}

}  // namespace
}  // namespace palpate
