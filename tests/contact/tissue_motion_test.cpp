#include "palpate/contact/tissue_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "tests/support/reference_data.h"

namespace palpate {
namespace {

constexpr double kFocal = 700, kBaseline = 5, kDepth = 90;

Rectification rectification_of(int width, int height) {
  Rectification rectification;
  rectification.size = {width, height};
  rectification.focal_px = kFocal;
  rectification.principal_x_px = 0.5 * (width - 1);
  rectification.principal_y_px = 0.5 * (height - 1);
  rectification.baseline_mm = kBaseline;
  rectification.identity = true;
  return rectification;
}

double texture(double x, double y) {
  return 110 + 22 * std::sin(1.9 * x + 1.5 * std::sin(0.7 * y)) + 20 * std::sin(1.7 * y + 1.2 * std::cos(0.9 * x)) +
         12 * std::sin(3.1 * x - 2.3 * y);
}

/// A textured plane that faces the camera, moved by `shift_mm`; `gain` is the light in the left eye.
RectifiedPair draw_plane(const Rectification& r, const Vec3& shift_mm, double gain = 1) {
  RectifiedPair pair;
  cv::RNG noise(5);
  const double depth = kDepth + shift_mm.z();
  for (double eye : {0.0, kBaseline}) {
    cv::Mat image(r.size, CV_8UC3);
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) {
        const double px = (x - r.principal_x_px) * depth / kFocal + eye - shift_mm.x();
        const double py = (y - r.principal_y_px) * depth / kFocal - shift_mm.y();
        const double value = texture(px, py) * (eye > 0 ? 1 : gain) + noise.gaussian(1.5);
        image.at<cv::Vec3b>(y, x) = cv::Vec3b(cv::saturate_cast<uchar>(0.4 * value),
                                              cv::saturate_cast<uchar>(0.45 * value), cv::saturate_cast<uchar>(value));
      }
    (eye > 0 ? pair.right : pair.left) = image;
  }
  return pair;
}

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 1e9 : values[values.size() / 2];
}

TEST(TissueMotion, MeasuresAShiftInAllThreeDirections) {
  const Rectification r = rectification_of(480, 360);
  TissueMotion motion(r);
  motion.start(draw_plane(r, Vec3::Zero()), {}, Vec3(0, 0, kDepth), 12);
  ASSERT_TRUE(motion.active());
  for (const Vec3& shift : {Vec3(0.3, -0.2, 0), Vec3(1.5, 0.5, -1), Vec3(0, 0, 3)}) {
    const auto points = motion.update(draw_plane(r, shift, 0.9), {}, {});
    ASSERT_GT(points.size(), 30u);
    std::vector<double> lateral, depth, ratio;
    for (const TissuePoint& point : points) {
      EXPECT_NEAR(point.rest_mm.z(), kDepth, 1);
      const Vec3 error = point.displacement_mm - shift;
      lateral.push_back(error.head<2>().norm());
      depth.push_back(std::abs(error.z()));
      ratio.push_back(depth.back() / point.deviation_mm);
    }
    EXPECT_LT(median_of(lateral), 0.05) << shift.transpose();
    EXPECT_LT(median_of(depth), 0.15) << shift.transpose();
    EXPECT_LT(median_of(ratio), 1.0) << shift.transpose();
  }
}

TEST(TissueMotion, LeavesOutWhatTheInstrumentCoversAndWhatIsGone) {
  const Rectification r = rectification_of(480, 360);
  TissueMotion motion(r);
  const auto reference = draw_plane(r, Vec3::Zero());
  cv::Mat mask = cv::Mat::zeros(r.size, CV_8U);
  mask(cv::Rect(240, 0, 240, 360)) = 255;
  motion.start(reference, mask, Vec3(0, 0, kDepth), 12);
  for (const TissuePoint& point : motion.update(reference, mask, {})) EXPECT_LT(point.rest_mm.x(), 0);

  RectifiedPair black = reference;
  black.left = cv::Mat(r.size, CV_8UC3, cv::Scalar::all(0));
  EXPECT_TRUE(motion.update(black, {}, {}).empty());
  EXPECT_FALSE(motion.update(reference, mask, {}).empty()) << "found again";
  motion.stop();
  EXPECT_FALSE(motion.active());
  EXPECT_TRUE(motion.update(reference, {}, {}).empty());
}

TEST(TissueMotion, StaysInactiveWhereThereIsNothingToFollow) {
  const Rectification r = rectification_of(480, 360);
  TissueMotion motion(r);
  RectifiedPair blank;
  blank.left = blank.right = cv::Mat(r.size, CV_8UC3, cv::Scalar(40, 40, 120));
  motion.start(blank, {}, Vec3(0, 0, kDepth), 12);
  EXPECT_FALSE(motion.active());
  motion.start(draw_plane(r, Vec3::Zero()), {}, Vec3(500, 0, kDepth), 12);
  EXPECT_FALSE(motion.active()) << "outside the image";
  motion.start(draw_plane(r, Vec3::Zero()), {}, Vec3(0, 0, -10), 12);
  EXPECT_FALSE(motion.active()) << "behind the camera";
}

TEST(TissueMotion, FindsTheLiverBackAtRestAfterItWasLetGo) {
  PALPATE_NEEDS_REFERENCE("rendered_liver");
  const auto folder = test::reference_data() / "rendered_liver";
  cv::VideoCapture left((folder / "left.mp4").string()), right((folder / "right.mp4").string());
  TissueMotion motion(rectification_of(960, 540));
  RectifiedPair pair;
  const Vec3 contact(-8.0, -0.15, 99.3);  // held from frame 15 to 89 and moved by up to 6 mm
  std::vector<double> held, released;
  for (int frame = 0; left.read(pair.left) && right.read(pair.right); ++frame) {
    if (frame == 0) motion.start(pair, {}, contact, 15);
    if (frame != 54 && frame != 96) continue;
    for (const TissuePoint& point : motion.update(pair, {}, {}))
      (frame == 54 ? held : released).push_back(point.displacement_mm.norm());
  }
  EXPECT_GT(median_of(held), 0.5);
  EXPECT_GT(released.size(), 50u);
  EXPECT_LT(median_of(released), 0.2);
}

}  // namespace
}  // namespace palpate
