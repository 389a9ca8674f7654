#include "palpate/instrument/still_parts.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

const cv::Size kSize(320, 192);
const cv::Mat kAll(kSize, CV_8U, cv::Scalar(255));

cv::Mat tissue() {
  return {kSize, CV_8UC3, cv::Scalar(60, 70, 160)};
}

cv::Mat blank() {
  return cv::Mat::zeros(kSize, CV_8U);
}

/// A shadow beneath an organ: a bow at the lower border, no shaft.
void draw_shadow(cv::Mat& image, const cv::Scalar& colour, int right_px = 0) {
  cv::ellipse(image, {160 + right_px, 110}, {80, 78}, 0, 10, 170, colour, 8);
}

void draw_shaft(cv::Mat& image, const cv::Scalar& colour) {
  cv::line(image, {319, 60}, {170, 90}, colour, 22);
}

TEST(StillParts, AShadowIsNoInstrumentWhileItStaysAlsoALittleBeside) {
  cv::Mat image = tissue(), mask = blank(), there = blank();
  draw_shadow(image, {15, 15, 20});
  draw_shadow(mask, 255);
  const StillParts still(image, mask);
  EXPECT_EQ(cv::countNonZero(still.left_out_of(mask, image, kAll)), 0);

  cv::Mat moved = tissue();
  draw_shadow(moved, {18, 17, 22}, 4);
  draw_shadow(there, 255, 4);
  EXPECT_LT(cv::countNonZero(still.left_out_of(there, moved, kAll)), 0.05 * cv::countNonZero(there));
}

TEST(StillParts, WhatHasTheShapeOfAnInstrumentStays) {
  cv::Mat image = tissue(), mask = blank();
  draw_shaft(image, {140, 140, 140});
  draw_shaft(mask, 255);
  const cv::Mat left = StillParts(image, mask).left_out_of(mask, image, kAll);
  EXPECT_EQ(cv::countNonZero(left), cv::countNonZero(mask));
}

TEST(StillParts, AnInstrumentIsPartedFromTheShadowThatItPasses) {
  cv::Mat image = tissue(), mask = blank(), shaft = blank();
  draw_shadow(image, {15, 15, 20});
  draw_shadow(mask, 255);
  const StillParts still(image, mask);
  cv::Mat later = image.clone();
  draw_shaft(later, {140, 140, 140});
  draw_shaft(shaft, 255);
  const cv::Mat left = still.left_out_of(mask | shaft, later, kAll);
  EXPECT_EQ(cv::countNonZero(shaft & ~left), 0);
  EXPECT_LT(cv::countNonZero(left & ~shaft), 0.05 * cv::countNonZero(mask));
}

TEST(StillParts, AnInstrumentRestsUntilItsEndMoves) {
  cv::Mat image = tissue(), mask = blank();
  draw_shaft(image, {140, 140, 140});
  draw_shaft(mask, 255);
  const StillParts still(image, mask);
  const auto before = find_instruments(mask, kAll);
  ASSERT_EQ(before.size(), 1U);
  EXPECT_TRUE(rests(before[0], kSize, still.in(image)));
  EXPECT_FALSE(rests(before[0], kSize, {})) << "nothing is known of the static frame";

  cv::Mat later = tissue(), moved = blank();
  cv::line(later, {319, 60}, {140, 96}, {140, 140, 140}, 22);
  cv::line(moved, {319, 60}, {140, 96}, 255, 22);
  const auto after = find_instruments(moved, kAll);
  ASSERT_EQ(after.size(), 1U);
  EXPECT_FALSE(rests(after[0], kSize, still.in(later)));
}

TEST(StillParts, NothingIsLeftOutWhereNothingWasFoundBefore) {
  cv::Mat mask = blank();
  draw_shadow(mask, 255);
  EXPECT_EQ(cv::countNonZero(StillParts(tissue(), blank()).left_out_of(mask, tissue(), kAll)), cv::countNonZero(mask));
  EXPECT_EQ(cv::countNonZero(StillParts().left_out_of(mask, tissue(), kAll)), cv::countNonZero(mask));
}

}  // namespace
}  // namespace palpate
