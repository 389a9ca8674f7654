#include "palpate/feedback/overlay.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "tests/support/meshes.h"

namespace palpate {
namespace {

const cv::Size kSize(960, 540);
const cv::Vec3b kTissue(60, 70, 150);

StereoRig pinhole_rig(const std::vector<double>& distortion = {}) {
  StereoRig rig;
  rig.image_size = kSize;
  rig.left.K = rig.right.K = cv::Matx33d(700, 0, 479.5, 0, 700, 269.5, 0, 0, 1);
  rig.left.distortion = rig.right.distortion = distortion;
  rig.right_from_left_mm = {-5, 0, 0};
  return rig;
}

TissueOptions tissue() {
  TissueOptions t;
  t.young_modulus_kPa = 100;
  t.poisson_ratio = 0.45;
  return t;
}

/// A box of 40 x 30 x 20 mm whose front face stands at z = 100 mm: it is seen between x = 340 and 620, y = 165 and 375.
TetMesh box(const std::array<int, 3>& cells) {
  TetMesh mesh = test::box_mesh({40, 30, 20}, cells);
  for (Vec3& node : mesh.nodes_mm) node += Vec3(-20, -15, 100);
  return mesh;
}

ForceEstimate contact(const std::function<double(const Vec3&)>& stress_kPa,
                      const std::array<int, 3>& cells = {4, 3, 2}) {
  const TetMesh mesh = box(cells);
  ForceEstimate e;
  e.status = FrameStatus::ok;
  e.in_contact = true;
  e.force_N = {0, 0, 1};
  e.mean_nodal_force_N = 0.1;
  e.tip_mm = {-45, 0, 100};
  e.deformed_nodes_mm = mesh.nodes_mm;
  e.boundary = boundary_triangles(mesh);
  for (const Vec3& node : mesh.nodes_mm) e.node_von_mises_kPa.push_back(stress_kPa(node));
  return e;
}

OverlayOptions fixed_scale() {
  OverlayOptions options;
  options.stress_scale_kPa = 100;
  options.chart = false;
  return options;
}

cv::Mat tissue_image() {
  return {kSize, CV_8UC3, cv::Scalar(kTissue)};
}

cv::Mat painted(const ForceEstimate& estimate, const OverlayOptions& options = fixed_scale()) {
  return OverlayPainter(make_rectification(pinhole_rig(), kSize), tissue(), options).paint(tissue_image(), estimate);
}

/// What an opacity of 0.65 makes of the tissue under the colour of a fraction of the scale.
void expect_blend(const cv::Vec3b& pixel, double fraction, double tolerance) {
  const cv::Vec3b colour = colour_at(colour_table(ColourMap::viridis), fraction);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c], 0.35 * kTissue[c] + 0.65 * colour[c], tolerance);
}

TEST(Overlay, ColoursTheFaceThatIsSeen) {
  const cv::Mat image = painted(contact([](const Vec3&) { return 100; }));
  expect_blend(image.at<cv::Vec3b>(270, 480), 1, 2);
  expect_blend(image.at<cv::Vec3b>(170, 345), 1, 2);
  expect_blend(image.at<cv::Vec3b>(370, 615), 1, 2);
  EXPECT_EQ(image.at<cv::Vec3b>(160, 480), kTissue) << "above the box";
  EXPECT_EQ(image.at<cv::Vec3b>(270, 625), kTissue) << "right of the box";
}

TEST(Overlay, InterpolatesTheStressOfTheNodes) {
  // Rises from 0 at the left rim to 100 kPa at the right one; x = 560 px is at 11.5 mm.
  const cv::Mat image = painted(contact([](const Vec3& p) { return 50 + 2.5 * p.x(); }));
  expect_blend(image.at<cv::Vec3b>(270, 560), 0.5 + 0.025 * (560 - 479.5) / 7, 3);
  expect_blend(image.at<cv::Vec3b>(300, 480), 0.5, 3);
}

TEST(Overlay, DoesNotShowTheHiddenSide) {
  const cv::Mat image = painted(contact([](const Vec3& p) { return p.z() > 101 ? 100 : 0; }));
  for (int y = 166; y < 375; y += 8)
    for (int x = 341; x < 620; x += 8) ASSERT_EQ(image.at<cv::Vec3b>(y, x), kTissue) << x << ", " << y;
}

TEST(Overlay, LeavesTissueWithoutStressAsItIs) {
  const cv::Mat image = painted(contact([](const Vec3&) { return 0; }));
  EXPECT_EQ(cv::norm(image(cv::Rect(340, 165, 280, 210)), tissue_image()(cv::Rect(340, 165, 280, 210))), 0);
}

TEST(Overlay, IsMoreTransparentWhereStressIsLow) {
  const cv::Mat low = painted(contact([](const Vec3&) { return 10; }));
  const cv::Mat high = painted(contact([](const Vec3&) { return 90; }));
  const double change_low = cv::norm(low.at<cv::Vec3b>(270, 480), kTissue);
  EXPECT_GT(change_low, 5);
  EXPECT_LT(change_low, 0.5 * cv::norm(high.at<cv::Vec3b>(270, 480), kTissue));
}

TEST(Overlay, KeepsTheInstrumentOnTop) {
  ForceEstimate estimate = contact([](const Vec3&) { return 100; });
  estimate.left_instrument_mask = cv::Mat::zeros(kSize, CV_8U);
  estimate.left_instrument_mask(cv::Rect(400, 200, 50, 100)).setTo(255);
  const cv::Mat image = painted(estimate);
  EXPECT_EQ(image.at<cv::Vec3b>(250, 425), kTissue);
  EXPECT_NE(image.at<cv::Vec3b>(250, 460), kTissue);
}

TEST(Overlay, FollowsDistortionAndRectification) {
  // The box and the mask are both where the recorded, distorted image shows them.
  StereoRig rig = pinhole_rig({-0.3, 0.1, 0, 0, 0});
  const double angle = 0.05;
  rig.right_from_left = Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
  const Rectification rectification = make_rectification(rig, kSize);
  ASSERT_FALSE(rectification.identity);
  ForceEstimate estimate = contact([](const Vec3&) { return 100; });
  for (Vec3& node : estimate.deformed_nodes_mm) node.x() += 30;
  const Vec3 under_instrument(42, -8, 100), free(45, 10, 100), corner(50, 15, 100);
  estimate.left_instrument_mask = cv::Mat::zeros(rectification.size, CV_8U);
  cv::circle(estimate.left_instrument_mask, project_to_rectified(rectification, under_instrument), 4, 255, cv::FILLED);

  const cv::Mat image = OverlayPainter(rectification, tissue(), fixed_scale()).paint(tissue_image(), estimate);
  const auto pixel = [&](const Vec3& point, const cv::Point& shift = {}) {
    return image.at<cv::Vec3b>(cv::Point(project_to_recorded_left(rig, point)) + shift);
  };
  EXPECT_EQ(pixel(under_instrument), kTissue);
  EXPECT_NE(pixel(under_instrument, {8, 0}), kTissue);
  EXPECT_NE(pixel(under_instrument, {-8, 0}), kTissue);
  EXPECT_NE(pixel(free), kTissue);
  EXPECT_NE(pixel(corner, {-3, -3}), kTissue);
  EXPECT_EQ(pixel(corner, {3, 3}), kTissue);
}

TEST(Overlay, ColoursOnlyAroundTheInstrumentWhenAsked) {
  OverlayOptions options = fixed_scale();
  options.region = OverlayRegion::around;
  options.radius_mm = 9;
  ForceEstimate estimate = contact([](const Vec3&) { return 100; });
  estimate.tip_mm = {-20, 0, 100};
  estimate.force_N.setZero();
  const cv::Mat image = painted(estimate, options);
  expect_blend(image.at<cv::Vec3b>(300, 350), 1, 2);
  EXPECT_EQ(image.at<cv::Vec3b>(270, 340 + 7 * 10), kTissue) << "10 mm away";
}

TEST(Overlay, KeepsItsScaleWhenTheStressFalls) {
  OverlayOptions options = fixed_scale();
  options.stress_scale_kPa = 0;
  OverlayPainter painter(make_rectification(pinhole_rig(), kSize), tissue(), options);
  painter.paint(tissue_image(), contact([](const Vec3&) { return 93; }));
  const cv::Mat image = painter.paint(tissue_image(), contact([](const Vec3&) { return 60; }));
  expect_blend(image.at<cv::Vec3b>(270, 480), 0.6, 3);
}

TEST(Overlay, DoesNotLetOneNodeSetTheScale) {
  // The face is at 40 kPa, so the scale ends at 50; one corner (0.6 % of the surface) is singular.
  OverlayOptions options = fixed_scale();
  options.stress_scale_kPa = 0;
  ForceEstimate estimate = contact([](const Vec3&) { return 40; }, {12, 9, 6});
  estimate.node_von_mises_kPa[0] = 1e5;
  expect_blend(painted(estimate, options).at<cv::Vec3b>(270, 480), 0.8, 3);
}

TEST(Overlay, ShowsNoStressOfAStateThatDidNotConverge) {
  ForceEstimate estimate = contact([](const Vec3&) { return 100; });
  estimate.status = FrameStatus::not_converged;
  EXPECT_EQ(painted(estimate).at<cv::Vec3b>(270, 480), kTissue);
}

TEST(Overlay, PointsTheArrowAlongTheForce) {
  ForceEstimate estimate = contact([](const Vec3&) { return 0; });
  estimate.tip_mm = {0, 0, 100};
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-1, 0, 0), Vec3(0, -1, 0)}) {
    estimate.force_N = 5 * direction;
    const cv::Mat image = painted(estimate);
    const cv::Point tip(480, 270), step(cvRound(20 * direction.x()), cvRound(20 * direction.y()));
    EXPECT_NE(image.at<cv::Vec3b>(tip + step), kTissue) << direction.transpose();
    EXPECT_EQ(image.at<cv::Vec3b>(tip - step), kTissue) << direction.transpose();
  }
}

TEST(Overlay, MarksAForceAlongTheLineOfSightByACrossOrADot) {
  ForceEstimate estimate = contact([](const Vec3&) { return 0; });
  estimate.tip_mm = {0, 0, 100};
  const auto changed = [&](double force_z_N, const cv::Point& shift) {
    estimate.force_N = {0, 0, force_z_N};
    return painted(estimate).at<cv::Vec3b>(cv::Point(480, 270) + shift) != kTissue;
  };
  EXPECT_TRUE(changed(5, {4, 4})) << "away from the camera: the arm of a cross";
  EXPECT_TRUE(changed(-5, {1, 1})) << "towards the camera: a dot";
  EXPECT_FALSE(changed(-5, {4, 4})) << "a dot has no arms";
  EXPECT_EQ(painted(estimate).at<cv::Vec3b>(270 + 30, 480), kTissue);
}

TEST(Overlay, DrawsALongerArrowForAGreaterForce) {
  OverlayPainter painter(make_rectification(pinhole_rig(), kSize), tissue(), fixed_scale());
  const auto arrow_px = [&](double force_N) {
    ForceEstimate estimate = contact([](const Vec3&) { return 0; });
    estimate.tip_mm = {0, 0, 100};
    estimate.force_N = {force_N, 0, 0};
    const cv::Mat image = painter.paint(tissue_image(), estimate);
    int length = 0;
    while (image.at<cv::Vec3b>(270, 480 + length) != kTissue) ++length;
    return length;
  };
  const int strong = arrow_px(19), weak = arrow_px(1);
  EXPECT_GT(strong, weak + 30);
}

TEST(Overlay, IsTheSameForEveryThreadCount) {
  const ForceEstimate estimate = contact([](const Vec3& p) { return 40 + p.x() + 2 * p.y(); });
  const cv::Mat several = painted(estimate);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const cv::Mat one = painted(estimate);
  cv::setNumThreads(threads);
  EXPECT_EQ(cv::norm(one, several, cv::NORM_INF), 0);
}

TEST(Overlay, SurvivesEveryStatusWithNothingToDraw) {
  OverlayPainter painter(make_rectification(pinhole_rig(), kSize), tissue());
  for (const FrameStatus status : {FrameStatus::no_contact, FrameStatus::ok, FrameStatus::tool_lost,
                                   FrameStatus::not_converged, FrameStatus::map_stale}) {
    ForceEstimate estimate;
    estimate.status = status;
    EXPECT_EQ(painter.paint(tissue_image(), estimate).size(), kSize);
  }
}

TEST(Overlay, RefusesAnImageOfAnotherSize) {
  OverlayPainter painter(make_rectification(pinhole_rig(), kSize), tissue());
  EXPECT_THROW(painter.paint(cv::Mat(100, 100, CV_8UC3), {}), std::invalid_argument);
}

TEST(Overlay, TurnsTheStatusDotYellowWhereThereIsAWarning) {
  ForceEstimate estimate = contact([](const Vec3&) { return 0; });
  const cv::Point dot(23, 23);
  const cv::Vec3b good = painted(estimate).at<cv::Vec3b>(dot);
  estimate.warnings = {"law_out_of_range"};
  const cv::Vec3b caution = painted(estimate).at<cv::Vec3b>(dot);
  EXPECT_GT(good[1], good[2]) << "green";
  EXPECT_GT(std::min(caution[1], caution[2]), 200) << "yellow";
  EXPECT_LT(caution[0], 100);
}

}  // namespace
}  // namespace palpate
