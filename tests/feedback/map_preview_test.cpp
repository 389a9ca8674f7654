#include "palpate/feedback/map_preview.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "palpate/feedback/map_json.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

const cv::Size kSize(800, 450);
constexpr int kBarWidth_px = 100;

Rectification rectification() {
  StereoRig rig;
  rig.image_size = kSize;
  rig.left.K = rig.right.K = cv::Matx33d(600, 0, 399.5, 0, 600, 224.5, 0, 0, 1);
  rig.right_from_left_mm = {-5, 0, 0};
  return make_rectification(rig, kSize);
}

/// A box whose front face is at z = 100 mm, seen between x = 280 and 520, y = 135 and 315; its right side is fixed.
TissueMap box_map() {
  TissueMap map;
  map.mesh = test::box_mesh({40, 30, 20}, {2, 2, 2});
  map.fixed_nodes = test::nodes_at(map.mesh, 0, 40);
  for (Vec3& node : map.mesh.nodes_mm) node += Vec3(-20, -15, 100);
  map.disparity.disparity_px = cv::Mat(kSize, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  map.disparity.deviation_px = map.disparity.disparity_px.clone();
  const cv::Rect face(280, 135, 240, 180);
  map.disparity.disparity_px(face).setTo(30);
  map.disparity.deviation_px(face).setTo(0.1);
  map.tissue.young_modulus_kPa = 27;
  map.report.coverage = 0.75;
  map.report.surface_ms = 12.5;
  map.report.mesh.smallest_dihedral_deg = 14;
  return map;
}

double brightness(const cv::Mat& image, const cv::Rect& area) {
  const cv::Scalar mean = cv::mean(image(area));
  return (mean[0] + mean[1] + mean[2]) / 3;
}

TEST(MapPreview, HasFourPanels) {
  const cv::Mat preview =
      draw_map_preview(cv::Mat(kSize, CV_8UC3, cv::Scalar(40, 40, 120)), rectification(), box_map());
  EXPECT_EQ(preview.size(), cv::Size(2 * kSize.width + kBarWidth_px, 2 * kSize.height));
}

TEST(MapPreview, DrawsTheWireframeOnTheMeshOnly) {
  const cv::Mat preview = draw_map_preview(cv::Mat(kSize, CV_8UC3, cv::Scalar::all(0)), rectification(), box_map());
  const auto drawn = [&](int x, int y) { return preview.at<cv::Vec3b>(y, x) != cv::Vec3b(0, 0, 0); };
  EXPECT_TRUE(drawn(400, 200)) << "the edge in the middle of the face";
  EXPECT_FALSE(drawn(360, 270)) << "inside a triangle";
  EXPECT_FALSE(drawn(200, 225)) << "beside the box";
}

TEST(MapPreview, MarksFixedNodesInAColourOfTheirOwn) {
  const cv::Mat preview = draw_map_preview(cv::Mat(kSize, CV_8UC3, cv::Scalar::all(0)), rectification(), box_map());
  const cv::Vec3b fixed = preview.at<cv::Vec3b>(224, 519), free = preview.at<cv::Vec3b>(224, 280);
  EXPECT_GT(fixed[2], fixed[0] + 100);
  EXPECT_LT(free[2], free[0]);
}

TEST(MapPreview, ColoursDepthWhereItWasMeasured) {
  const cv::Mat preview = draw_map_preview(cv::Mat(kSize, CV_8UC3, cv::Scalar::all(0)), rectification(), box_map());
  const cv::Rect depth(kSize.width, 0, kSize.width, kSize.height);
  EXPECT_GT(brightness(preview(depth), {300, 200, 50, 50}), 20);
  EXPECT_EQ(brightness(preview(depth), {150, 200, 50, 50}), 0);
}

TEST(MapPreview, ShowsDepthUpToTheBorderOfTheImage) {
  TissueMap map = box_map();
  map.disparity.disparity_px.setTo(30);
  const cv::Mat preview = draw_map_preview(cv::Mat(kSize, CV_8UC3, cv::Scalar::all(0)), rectification(), map);
  const cv::Vec3b middle = preview.at<cv::Vec3b>(200, kSize.width + 400);
  for (int y = 1; y < kSize.height - 1; ++y)
    ASSERT_EQ(preview.at<cv::Vec3b>(y, 2 * kSize.width - 2), middle) << "row " << y << " is hidden";
}

TEST(MapPreview, SurvivesAMapWithoutAnything) {
  TissueMap map;
  map.disparity.disparity_px = cv::Mat(kSize, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  map.disparity.deviation_px = map.disparity.disparity_px;
  EXPECT_FALSE(draw_map_preview(cv::Mat(kSize, CV_8UC3, cv::Scalar::all(0)), rectification(), map).empty());
}

TEST(MapJson, SaysWhatTheMapIs) {
  const nlohmann::json json = nlohmann::json::parse(map_json(box_map(), rectification()));
  EXPECT_EQ(json["counts"]["elements"], 48);
  EXPECT_EQ(json["counts"]["nodes"], 27);
  EXPECT_EQ(json["counts"]["fixed_nodes"], 9);
  EXPECT_EQ(json["times_ms"]["surface"], 12.5);
  EXPECT_EQ(json["coverage"], 0.75);
  EXPECT_EQ(json["smallest_dihedral_deg"], 14);
  EXPECT_EQ(json["tissue"]["law"], "saint-venant-kirchhoff");
  EXPECT_EQ(json["rectified_from_left"], nlohmann::json::parse("[[1,0,0],[0,1,0],[0,0,1]]"));
}

}  // namespace
}  // namespace palpate
