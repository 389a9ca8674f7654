#include "palpate/observe/tissue_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr double kDisparity_px = 20;

Rectification straight_rig() {
  Rectification r;
  r.size = {320, 240};
  r.focal_px = 400;
  r.principal_x_px = 160;
  r.principal_y_px = 120;
  r.baseline_mm = 5;
  r.identity = true;
  return r;
}

cv::Mat texture(cv::Size size) {
  cv::Mat noise(size, CV_8UC3);
  cv::RNG random(5);
  random.fill(noise, cv::RNG::NORMAL, 110, 60);
  cv::GaussianBlur(noise, noise, {}, 2);
  return noise;
}

cv::Mat moved(const cv::Mat& image, double x, double y) {
  cv::Mat result;
  cv::warpAffine(image, result, cv::Matx23d(1, 0, x, 0, 1, y), image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return result;
}

/// A plane at one disparity, moved by `motion_px` (x, y, disparity).
RectifiedPair plane(const Vec3& motion_px, double gain = 1) {
  const cv::Mat image = texture({320, 240});
  RectifiedPair pair;
  pair.left = gain * moved(image, motion_px.x(), motion_px.y());
  pair.right = gain * moved(image, motion_px.x() - motion_px.z() - kDisparity_px, motion_px.y());
  return pair;
}

/// Nine of ten points are nearer to the motion than this, px.
double ninth_decile_px(const std::vector<TissuePoint>& seen, const Vec3& motion_px) {
  std::vector<double> errors_px;
  for (const TissuePoint& point : seen) errors_px.push_back((point.motion_px - motion_px).norm());
  std::sort(errors_px.begin(), errors_px.end());
  return errors_px.at(errors_px.size() * 9 / 10);
}

class TissueTracking : public testing::Test {
 protected:
  TissueTracker tracker_{plane(Vec3::Zero()), straight_rig(), cv::Mat(240, 320, CV_32F, cv::Scalar(kDisparity_px)),
                         cv::Mat(240, 320, CV_8U, 255)};
};

TEST_F(TissueTracking, FindsTheMotionOfThePointsToAFractionOfAPixel) {
  ASSERT_GT(tracker_.points().size(), 100u);
  const Vec3 motion_px(2.3, -1.7, 0.6);
  const auto seen = tracker_.update(plane(motion_px), {}, {}, tracker_.points());
  ASSERT_GT(seen.size(), 0.7 * static_cast<double>(tracker_.points().size()));
  EXPECT_LT(ninth_decile_px(seen, motion_px), 0.3);
}

TEST_F(TissueTracking, DoesNotMistakeAnotherExposureForMotion) {
  const auto seen = tracker_.update(plane(Vec3::Zero(), 0.75), {}, {}, tracker_.points());
  ASSERT_GT(seen.size(), 0.7 * static_cast<double>(tracker_.points().size()));
  EXPECT_LT(ninth_decile_px(seen, Vec3::Zero()), 0.2);
}

TEST_F(TissueTracking, FindsALongWayOnlyFromWhereItIsExpected) {
  const Vec3 motion_px(45, 20, 0);
  std::vector<TissuePoint> expected = tracker_.points();
  for (TissuePoint& point : expected) point.motion_px = motion_px + Vec3(1, -1, 0.5);
  const auto seen = tracker_.update(plane(motion_px), {}, {}, expected);
  ASSERT_GT(seen.size(), 0.4 * static_cast<double>(expected.size()));
  EXPECT_LT(ninth_decile_px(seen, motion_px), 0.5);
}

TEST_F(TissueTracking, SeesNoPointUnderAnInstrument) {
  cv::Mat instrument = cv::Mat::zeros(240, 320, CV_8U);
  instrument(cv::Rect(100, 0, 120, 240)) = 255;
  for (const TissuePoint& point : tracker_.update(plane(Vec3::Zero()), instrument, {}, tracker_.points())) {
    const double x_px = 400 * point.rest_mm.x() / point.rest_mm.z() + 160;
    EXPECT_TRUE(x_px < 100 || x_px > 220) << x_px;
  }
}

TEST_F(TissueTracking, SeesNothingInAnotherScene) {
  RectifiedPair other;
  cv::flip(texture({320, 240}), other.left, -1);
  other.right = other.left;
  EXPECT_LT(tracker_.update(other, {}, {}, tracker_.points()).size(),
            0.1 * static_cast<double>(tracker_.points().size()));
}

}  // namespace
}  // namespace palpate
