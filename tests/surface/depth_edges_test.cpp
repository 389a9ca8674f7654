#include "palpate/surface/depth_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "palpate/surface/cocone.h"
#include "palpate/surface/cut_surface.h"
#include "palpate/surface/extend_rim.h"
#include "palpate/surface/seen_tissue.h"
#include "tests/surface/seen_surface.h"

namespace palpate {
namespace {

using namespace palpate::test;

constexpr double kPitch = 0.3 / 90;

View noisy(double noise_mm) {
  View view;
  view.noise_mm = noise_mm;
  return view;
}

/// Depth over x and y.
TrueSurface height_field(std::function<double(double, double)> depth_mm) {
  return {"height field", [depth_mm](const Vec3& p) { return depth_mm(p.x(), p.y()) - p.z(); }};
}

DepthEdges edges_of(const TrueSurface& truth, const View& view) {
  return find_depth_edges(make_depth_cells(look_at(truth, view), kPitch, {}), {});
}

int cells_on_edges(const DepthEdges& edges) {
  return cv::countNonZero(edges.jump_w > 0);
}

TEST(DepthEdges, OrgansCreasesAndSlopesHaveNone) {
  EXPECT_EQ(cells_on_edges(edges_of(bumpy_organ(), noisy(0.5))), 0);
  const auto roof = height_field([](double x, double) { return 85 + std::abs(x); });
  EXPECT_EQ(cells_on_edges(edges_of(roof, noisy(0.3))), 0);
  const auto slope = height_field([](double x, double) { return 95 + 1.5 * x; });
  EXPECT_EQ(cells_on_edges(edges_of(slope, noisy(0.3))), 0);
}

TEST(DepthEdges, KeepARimFromBeingDrawnOverAGapToWhatIsMeasuredBeyond) {
  constexpr double kGap_mm = 6;
  const auto depth_mm = [](double x, double y) { return 90 + 0.01 * (x * x + y * y); };
  const auto two_organs =
      height_field([&](double x, double y) { return depth_mm(x, y) + (x > 0 && x < kGap_mm ? 30 : 0); });
  const DepthEdges edges = edges_of(two_organs, noisy(0.2));
  std::vector<Vec3> coarse, measured;
  for (double y = -12; y <= 12; y += 0.5)
    for (double x = -15; x <= 15; x += 0.5)
      if (x <= 0 || x >= kGap_mm) measured.emplace_back(x, y, depth_mm(x, y));
  for (double y = -12; y <= 12; y += 3)
    for (double x = -15; x < 0; x += 3) coarse.emplace_back(x, y, depth_mm(x, y));
  const Surface thinned = cocone(coarse, {});
  const auto farthest_mm = [](const Surface& surface) {
    double x = -1e9;
    for (const Vec3& vertex : surface.vertices_mm) x = std::max(x, vertex.x());
    return x;
  };
  ASSERT_GT(farthest_mm(extend_rim(thinned, measured, 12)), kGap_mm) << "nothing keeps it without edges";
  EXPECT_LT(farthest_mm(extend_rim(thinned, measured, 12, &edges)), 2);
}

TEST(DepthEdges, PartABallFromTheWallWithinAMillimetre) {
  for (int ramp_px : {0, 6}) {
    View view = noisy(0.3);
    view.ramp_px = ramp_px;
    const PointCloud cloud = look_at(ball_before_wall(), view);
    const DepthEdges edges = find_depth_edges(make_depth_cells(cloud, kPitch, {}), {});
    const std::vector<SurfacePiece> pieces = cut_surfaces(split_at_edges(cloud, edges), edges, 1.5, {});
    ASSERT_EQ(pieces.size(), 2u) << "ramp " << ramp_px;
    const SurfacePiece& ball = pieces[0].depth_mm < 110 ? pieces[0] : pieces[1];
    // Viewing rays touch the ball, radius 18 at 85 mm, on a circle of radius r = 18 sqrt(1 - (18 / 85)^2).
    const double ratio = 18.0 / 85, tangent = ratio / std::sqrt(1 - ratio * ratio);
    double farthest = 0;
    for (const Vec3& v : ball.surface.vertices_mm) {
      EXPECT_LT(v.z(), 100);
      farthest = std::max(farthest, std::hypot(v.x(), v.y()) / v.z());
    }
    EXPECT_NEAR(farthest * 85, tangent * 85, 1) << "ramp " << ramp_px;
    for (const SurfacePiece& piece : pieces)
      EXPECT_LT(rms_distance_mm(ball_before_wall(), piece.surface.vertices_mm), 0.2) << "ramp " << ramp_px;
  }
}

TEST(DepthEdges, AnEdgeThatEndsInsideTheSurfaceIsCutToo) {
  // A step of 6 mm that runs out towards +x.
  const auto fold = height_field(
      [](double x, double y) { return 95 - 6 * std::clamp((12 - x) / 20, 0.0, 1.0) * std::clamp(y / 0.3, 0.0, 1.0); });
  const PointCloud cloud = look_at(fold, noisy(0.2));
  const DepthEdges edges = find_depth_edges(make_depth_cells(cloud, kPitch, {}), {});
  const std::vector<SurfacePiece> pieces = cut_surfaces(split_at_edges(cloud, edges), edges, 1.5, {});
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(topology_fault(pieces[0].surface), "");
  for (const Triangle& t : pieces[0].surface.triangles) {
    double nearest = 1e9, farthest = 0, x = -1e9;
    for (int corner : t) {
      const Vec3& v = pieces[0].surface.vertices_mm[static_cast<size_t>(corner)];
      x = std::max(x, v.x());
      nearest = std::min(nearest, v.z());
      farthest = std::max(farthest, v.z());
    }
    EXPECT_TRUE(x >= -8 || farthest - nearest < 3) << "a face climbs the step";
  }
}

/// What is seen of a surface beside a stripe that an instrument covers, |x| < half its width.
DepthCells with_stripe(const TrueSurface& truth, double half_width_mm) {
  const PointCloud all = look_at(truth, noisy(0.2));
  PointCloud seen;
  std::vector<Vec3> covered;
  for (size_t i = 0; i < all.size(); ++i) {
    if (std::abs(all.position_mm[i].x()) < half_width_mm) {
      covered.push_back(all.position_mm[i]);
      continue;
    }
    seen.position_mm.push_back(all.position_mm[i]);
    seen.depth_deviation_mm.push_back(all.depth_deviation_mm[i]);
  }
  DepthCells cells = make_depth_cells(seen, kPitch, covered);
  close_covered(cells, {});
  return cells;
}

TEST(CloseCovered, ContinuesWhatBothSidesAgreeOn) {
  const auto bowl = height_field([](double x, double y) { return 90 + (x * x + y * y) / 80; });
  const DepthCells cells = with_stripe(bowl, 4);
  double worst = 0;
  int closed = 0;
  for (int r = 0; r < cells.w.rows; ++r)
    for (int c = 0; c < cells.w.cols; ++c)
      if (cells.closed(r, c)) {
        ++closed;
        worst = std::max(worst, bowl.distance_mm(cells.point_mm({c, r})));
      }
  EXPECT_GT(closed, 1000);
  EXPECT_LT(worst, 1);
}

TEST(CloseCovered, LeavesOpenWhatMayHideAnEdge) {
  const auto step = height_field([](double x, double) { return x < 0 ? 85.0 : 98.0; });
  EXPECT_LT(cv::countNonZero(with_stripe(step, 4).closed), 50);
  const auto flat = height_field([](double, double) { return 90.0; });
  EXPECT_LT(cv::countNonZero(with_stripe(flat, 9).closed), 50) << "18 mm are hidden";
}

TEST(CutSurfaces, AHoleThroughWhichAnotherDepthIsSeenStaysOpen) {
  const auto window = height_field([](double x, double y) { return std::hypot(x, y) < 5 ? 110.0 : 90.0; });
  const PointCloud cloud = look_at(window, noisy(0.2));
  const DepthEdges edges = find_depth_edges(make_depth_cells(cloud, kPitch, {}), {});
  const std::vector<SurfacePiece> pieces = cut_surfaces(split_at_edges(cloud, edges), edges, 1.5, {});
  EXPECT_EQ(boundary_loops(pieces[0].surface), 2);
  for (const Vec3& v : pieces[0].surface.vertices_mm) EXPECT_GT(std::hypot(v.x(), v.y()), 4);
}

TEST(SeenTissue, TellsSeenFromClosedFromOutside) {
  Surface sheet{{{-20, -20, 90}, {20, -20, 90}, {20, 20, 90}, {-20, 20, 90}}, {{0, 2, 1}, {0, 3, 2}}};
  PointCloud cloud;
  for (double x = -30; x <= 30; x += 0.2)
    for (double y = -30; y <= 30; y += 0.2) {
      cloud.position_mm.emplace_back(x, y, 90);
      cloud.depth_deviation_mm.push_back(0.1f);
    }
  DepthCells cells = make_depth_cells(cloud, kPitch, {});
  for (int r = 0; r < cells.closed.rows; ++r)
    for (int c = 0; c < cells.closed.cols; ++c)
      if (cells.point_mm({c, r}).x() > 10) cells.closed(r, c) = 255;
  const SeenTissue seen = seen_tissue(sheet, cells);
  EXPECT_EQ(sight_of(seen, {0, 0, 91}, 1.5), SeenTissue::Sight::seen);
  EXPECT_EQ(sight_of(seen, {15, 0, 90}, 1.5), SeenTissue::Sight::closed);
  EXPECT_EQ(sight_of(seen, {0, 0, 93}, 1.5), SeenTissue::Sight::none);
  EXPECT_EQ(sight_of(seen, {0, 25, 90}, 1.5), SeenTissue::Sight::none);
  EXPECT_NEAR(distance_to_edge_mm(seen, {0, 15, 90}), 5, 0.5);
  EXPECT_EQ(distance_to_edge_mm(seen, {0, 25, 90}), 0);
}

}  // namespace
}  // namespace palpate
