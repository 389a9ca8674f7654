#include "palpate/feedback/rasterize.h"

#include <gtest/gtest.h>

#include <limits>

namespace palpate {
namespace {

const cv::Size kImage(64, 48);

int triangle_at(const VisibleTriangles& visible, int x, int y) {
  if (!visible.area.contains({x, y})) return -1;
  return visible.triangle.at<int>(y - visible.area.y, x - visible.area.x);
}

TEST(Rasterize, WeightsGiveBackThePixel) {
  const std::vector<ScreenVertex> vertices = {{{5.3f, 4.1f}, 1}, {{50.2f, 10.7f}, 1}, {{20.9f, 40.4f}, 1}};
  VisibleTriangles visible;
  rasterize(vertices, {{0, 1, 2}}, kImage, visible);
  int seen = 0;
  for (int y = 0; y < kImage.height; ++y)
    for (int x = 0; x < kImage.width; ++x) {
      if (triangle_at(visible, x, y) < 0) continue;
      const cv::Vec2f w = visible.barycentric.at<cv::Vec2f>(y - visible.area.y, x - visible.area.x);
      const cv::Point2f p = w[0] * vertices[0].px + w[1] * vertices[1].px + (1 - w[0] - w[1]) * vertices[2].px;
      EXPECT_NEAR(p.x, x, 1e-3);
      EXPECT_NEAR(p.y, y, 1e-3);
      ++seen;
    }
  const cv::Point2f a = vertices[1].px - vertices[0].px, b = vertices[2].px - vertices[0].px;
  EXPECT_NEAR(seen, 0.5 * a.cross(b), 40) << "pixels seen against the area of the triangle";
}

TEST(Rasterize, ShowsTheNearestWhateverTheOrder) {
  const std::vector<ScreenVertex> vertices = {{{0, 0}, 0.01f}, {{60, 0}, 0.01f}, {{0, 40}, 0.01f},
                                              {{0, 0}, 0.02f}, {{60, 0}, 0.02f}, {{0, 40}, 0.02f}};
  VisibleTriangles visible;
  rasterize(vertices, {{0, 1, 2}, {3, 4, 5}}, kImage, visible);
  EXPECT_EQ(triangle_at(visible, 10, 10), 1);
  rasterize(vertices, {{3, 4, 5}, {0, 1, 2}}, kImage, visible);
  EXPECT_EQ(triangle_at(visible, 10, 10), 0);
}

TEST(Rasterize, CutsTwoTrianglesThatCrossWhereTheyCross) {
  // One plane rises from left to right, the other falls; they meet at x = 30.
  const std::vector<ScreenVertex> vertices = {{{0, 0}, 1}, {{60, 0}, 3}, {{0, 80}, 1},
                                              {{0, 0}, 3}, {{60, 0}, 1}, {{0, 80}, 3}};
  VisibleTriangles visible;
  rasterize(vertices, {{0, 1, 2}, {3, 4, 5}}, kImage, visible);
  EXPECT_EQ(triangle_at(visible, 28, 10), 1);
  EXPECT_EQ(triangle_at(visible, 32, 10), 0);
}

TEST(Rasterize, LeavesNoGapBetweenNeighbours) {
  // A fan around a point in the middle of the image.
  std::vector<ScreenVertex> vertices = {{{31.7f, 23.3f}, 1}};
  std::vector<Triangle> fan;
  const std::vector<cv::Point2f> rim = {{-5, -5}, {20, -5}, {41.3f, -5}, {70, -5},   {70, 17},
                                        {70, 55}, {33, 55}, {-5, 55},    {-5, 21.9f}};
  for (const cv::Point2f& px : rim) vertices.push_back({px, 1});
  const int n = static_cast<int>(rim.size());
  for (int i = 0; i < n; ++i) fan.push_back({0, 1 + i, 1 + (i + 1) % n});
  VisibleTriangles visible;
  rasterize(vertices, fan, kImage, visible);
  for (int y = 0; y < kImage.height; ++y)
    for (int x = 0; x < kImage.width; ++x) EXPECT_GE(triangle_at(visible, x, y), 0) << x << ", " << y;
}

TEST(Rasterize, LeavesOutWhatIsOutsideOrNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<ScreenVertex> vertices = {{{100, 100}, 1}, {{160, 100}, 1}, {{100, 140}, 1},
                                              {{0, 0}, nan},   {{60, 0}, 1},    {{0, 40}, 1}};
  VisibleTriangles visible;
  rasterize(vertices, {{0, 1, 2}, {3, 4, 5}}, kImage, visible);
  EXPECT_TRUE(visible.area.empty());
}

}  // namespace
}  // namespace palpate
