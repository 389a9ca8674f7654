#include "palpate/feedback/colour_map.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "palpate/feedback/strip_chart.h"

namespace palpate {
namespace {

double lightness(const cv::Vec3b& bgr) {
  cv::Mat pixel(1, 1, CV_8UC3, cv::Scalar(bgr)), lab;
  cv::cvtColor(pixel, lab, cv::COLOR_BGR2Lab);
  return lab.at<cv::Vec3b>(0, 0)[0];
}

TEST(ColourMap, GrowsLighterWithTheValue) {
  const ColourTable table = colour_table(ColourMap::viridis);
  for (size_t i = 8; i < 256; i += 8) EXPECT_GE(lightness(table[i]), lightness(table[i - 8])) << i;
  EXPECT_GT(lightness(table[255]), lightness(table[0]) + 100);
}

TEST(ColourMap, JetGoesFromBlueToRed) {
  const ColourTable table = colour_table(ColourMap::jet);
  EXPECT_GT(table[0][0], table[0][2]);
  EXPECT_GT(table[255][2], table[255][0]);
}

TEST(ColourMap, ClampsToItsEnds) {
  const ColourTable table = colour_table(ColourMap::viridis);
  EXPECT_EQ(colour_at(table, -3), table[0]);
  EXPECT_EQ(colour_at(table, 7), table[255]);
}

TEST(ColourBar, HasTheHighestColourOnTop) {
  cv::Mat image(300, 200, CV_8UC3, cv::Scalar::all(40));
  const ColourTable table = colour_table(ColourMap::viridis);
  draw_colour_bar(image, {10, 10, 110, 260}, table, {0, 50, "kPa"}, 1);
  int first = -1, last = -1;
  for (int y = 0; y < image.rows; ++y) {
    const cv::Vec3b pixel = image.at<cv::Vec3b>(y, 22);
    if (pixel == table[255] && first < 0) first = y;
    if (pixel == table[0]) last = y;
  }
  ASSERT_GE(first, 0);
  EXPECT_GT(last, first + 150);
}

/// Pixels of the curve's colour.
int curve_pixels(const StripChart& chart) {
  cv::Mat image(124, 300, CV_8UC3, cv::Scalar::all(0)), red;
  chart.draw(image, {0, 0, 300, 124}, cv::Scalar(0, 0, 255), 1);
  cv::inRange(image, cv::Scalar(0, 0, 150), cv::Scalar(60, 60, 255), red);
  return cv::countNonZero(red);
}

TEST(StripChart, LeavesAGapWhereThereIsNoAnswer) {
  StripChart whole(10), with_gap(10), empty(10);
  for (int i = 0; i < 100; ++i) {
    const double time_s = 0.1 * i;
    whole.add(time_s, 3.0);
    with_gap.add(time_s, i >= 20 && i < 70 ? std::optional<double>() : 3.0);
    empty.add(time_s, std::nullopt);
  }
  EXPECT_GT(curve_pixels(whole), 200);
  EXPECT_NEAR(curve_pixels(with_gap), 0.5 * curve_pixels(whole), 0.1 * curve_pixels(whole));
  EXPECT_EQ(curve_pixels(empty), 0);
}

TEST(StripChart, ShowsASmallForceThatBeginsAtNothingAtItsOwnScale) {
  StripChart chart(10), per_modulus(10, "N/kPa");
  for (StripChart* each : {&chart, &per_modulus}) {
    each->add(0, 0.0);
    each->add(0.1, 0.02);
  }
  EXPECT_DOUBLE_EQ(chart.max_N(), 0.1);
  EXPECT_DOUBLE_EQ(per_modulus.max_N(), 0.05);
}

TEST(StripChart, ForgetsWhatIsOlderThanItShows) {
  StripChart chart(2);
  for (int i = 0; i < 100; ++i) chart.add(0.04 * i, 1.0);
  for (int i = 100; i < 200; ++i) chart.add(0.04 * i, std::nullopt);
  EXPECT_EQ(curve_pixels(chart), 0);
}

}  // namespace
}  // namespace palpate
