#include "palpate/instrument/find_tip.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

/// A rectangle turned by an angle whose end stands at `tip`, with a tapered jaw, long enough to leave the image.
cv::Mat drawn_instrument(const cv::Point2d& tip, double angle_deg, double width, double jaw, double opening = 0) {
  const cv::Point2d axis(std::cos(angle_deg * CV_PI / 180), std::sin(angle_deg * CV_PI / 180));
  const cv::Point2d side(-axis.y, axis.x);
  const auto at = [&](double back, double across) {
    const cv::Point2d p = tip - back * axis + across * side;
    return cv::Point(cvRound(p.x * 16), cvRound(p.y * 16));
  };
  cv::Mat mask = cv::Mat::zeros(540, 960, CV_8U);
  const auto fill = [&](const std::vector<cv::Point>& corners) {
    cv::fillConvexPoly(mask, corners, 255, cv::LINE_8, 4);
  };
  fill({at(jaw, width / 2), at(jaw, -width / 2), at(2000, -width / 2), at(2000, width / 2)});
  if (opening == 0) {
    fill({at(0, -4), at(0, 4), at(jaw + 1, width / 2), at(jaw + 1, -width / 2)});
  } else {
    fill({at(0, opening), at(0, opening + 6), at(jaw + 1, width / 2), at(jaw + 1, 0)});
    fill({at(0, -opening), at(0, -opening - 6), at(jaw + 1, -width / 2), at(jaw + 1, 0)});
  }
  return mask;
}

TEST(FindTip, FindsTheFarEndAtAnyAngle) {
  for (double angle : {-170.0, -120.0, -60.0, -15.0, 35.0, 90.0, 160.0}) {
    const cv::Point2d tip(470.3, 260.6);
    const auto found = find_tip(drawn_instrument(tip, angle, 44, 70));
    ASSERT_TRUE(found) << "angle " << angle;
    EXPECT_LT(cv::norm(found->tip_px - tip), 1.5) << "angle " << angle;
    EXPECT_NEAR(found->axis.x, std::cos(angle * CV_PI / 180), 0.03);
    EXPECT_NEAR(found->axis.y, std::sin(angle * CV_PI / 180), 0.03);
    EXPECT_NEAR(found->width_px, 44, 4);
  }
}

TEST(FindTip, FindsTheMiddleBetweenOpenJaws) {
  const cv::Point2d tip(430.2, 300.4);
  const auto found = find_tip(drawn_instrument(tip, -160, 44, 80, 12));
  ASSERT_TRUE(found);
  EXPECT_LT(cv::norm(found->tip_px - tip), 2.5);
}

TEST(FindTip, FindsTheEndOfAThinRodThatComesOutOfASleeve) {
  for (double rod : {80.0, 140.0, 260.0}) {
    const cv::Point2d tip(440.4, 290.7);
    const double angle_deg = -166;
    const cv::Point2d axis(std::cos(angle_deg * CV_PI / 180), std::sin(angle_deg * CV_PI / 180));
    const cv::Mat sleeve = drawn_instrument(tip - rod * axis, angle_deg, 40, 8);
    const auto found = find_tip(drawn_instrument(tip, angle_deg, 22, 6) | sleeve);
    ASSERT_TRUE(found) << "rod of " << rod;
    EXPECT_LT(cv::norm(found->tip_px - tip), 2) << "rod of " << rod;
    EXPECT_GT(found->axis.dot(axis), 0.999) << "rod of " << rod;
  }
}

TEST(FindTip, FindsNothingInAnEmptyMask) {
  EXPECT_FALSE(find_tip(cv::Mat::zeros(540, 960, CV_8U)));
}

TEST(FindTip, RejectsABlobFarFromTheBorder) {
  cv::Mat mask = drawn_instrument({430, 300}, -160, 44, 80);
  mask(cv::Rect(600, 0, 360, 540)) = 0;
  EXPECT_FALSE(find_tip(mask));
}

TEST(FindTip, FindsTheTipWhereTheShaftIsTooDarkToBeSeen) {
  const cv::Point2d tip(640.2, 330.4);
  cv::Mat mask = drawn_instrument(tip, -160, 44, 80);
  mask(cv::Rect(860, 0, 100, 540)) = 0;
  const auto found = find_tip(mask);
  ASSERT_TRUE(found);
  EXPECT_LT(cv::norm(found->tip_px - tip), 3);
  EXPECT_NEAR(found->axis.x, std::cos(-160 * CV_PI / 180), 0.05);
}

TEST(FindTip, RejectsARoundBlobAtTheBorder) {
  cv::Mat mask = cv::Mat::zeros(540, 960, CV_8U);
  cv::circle(mask, {950, 270}, 60, 255, cv::FILLED);
  EXPECT_FALSE(find_tip(mask));
}

TEST(FindTip, LetsAnInstrumentEnterFromTheEdgeOfTheScope) {
  cv::Mat area = cv::Mat::zeros(540, 960, CV_8U);
  cv::circle(area, {480, 270}, 250, 255, cv::FILLED);
  const cv::Point2d tip(430, 280);
  const cv::Mat mask = drawn_instrument(tip, -160, 44, 80) & area;
  EXPECT_FALSE(find_tip(mask));
  const auto found = find_tip(mask, area);
  ASSERT_TRUE(found);
  EXPECT_LT(cv::norm(found->tip_px - tip), 1.5);
}

}  // namespace
}  // namespace palpate
