#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>

#include "palpate/surface/cocone.h"
#include "tests/support/reference_data.h"
#include "tests/surface/seen_surface.h"

namespace palpate {
namespace {

using namespace palpate::test;

constexpr double kFocal_px = 700, kCx_px = 479.5, kCy_px = 269.5;

class RenderedOrgan : public testing::TestWithParam<std::string> {};

/// A dense cloud as good stereo would give it, from the true depth of the rendered scenes.
TEST_P(RenderedOrgan, SurfaceFollowsTheTrueDepthUnderNoiseAndOutliers) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  const auto folder = palpate::test::reference_data() / GetParam();
  const cv::Mat depth = cv::imread((folder / "depth0_left.tiff").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat kind = cv::imread((folder / "id0_left.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_32F);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.4);
  std::uniform_real_distribution<double> uniform(0, 1);
  PointCloud cloud;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      if (kind.at<uchar>(y, x) != 1) continue;
      double z = static_cast<double>(depth.at<float>(y, x)) + noise(random);
      if (uniform(random) < 0.03) z += 40 * (uniform(random) - 0.5);
      cloud.position_mm.emplace_back((x - kCx_px) / kFocal_px * z, (y - kCy_px) / kFocal_px * z, z);
      cloud.depth_deviation_mm.push_back(0.4f);
      cloud.correlation.push_back(0.8f);
      cloud.colour.emplace_back();
    }
  const Surface surface = cocone(clean_points(cloud, 2, {}).position_mm, {});
  EXPECT_EQ(topology_fault(surface), "");
  EXPECT_EQ(boundary_loops(surface), 1);
  EXPECT_LT(fraction_facing_away(surface), 0.002);
  double sum = 0;
  int count = 0;
  for (const Vec3& v : surface.vertices_mm) {
    const int x = static_cast<int>(std::lround(kFocal_px * v.x() / v.z() + kCx_px)),
              y = static_cast<int>(std::lround(kFocal_px * v.y() / v.z() + kCy_px));
    if (x < 1 || y < 1 || x >= depth.cols - 1 || y >= depth.rows - 1 || kind.at<uchar>(y, x) != 1) continue;
    // Across the surface, not along the ray: at the silhouette one pixel is millimetres of depth.
    const double sx = static_cast<double>(depth.at<float>(y, x + 1) - depth.at<float>(y, x - 1)) / 2,
                 sy = static_cast<double>(depth.at<float>(y + 1, x) - depth.at<float>(y - 1, x)) / 2;
    const double slope = std::hypot(sx, sy) * kFocal_px / v.z();
    sum += std::pow((v.z() - static_cast<double>(depth.at<float>(y, x))) / std::hypot(1, slope), 2);
    ++count;
  }
  ASSERT_GT(count, 400);
  EXPECT_LT(std::sqrt(sum / count), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Scenes, RenderedOrgan, testing::Values("rendered_uterus", "rendered_liver"));

}  // namespace
}  // namespace palpate
