#include "palpate/estimate/touchable.h"

#include <gtest/gtest.h>

#include "palpate/volume/body.h"

namespace palpate {
namespace {

/// A flat organ of 40 x 40 mm at 90 mm, seen but for x > 10, where an instrument stood before it; other tissue beside
/// it at 110 mm.
class FlatOrgan : public testing::Test {
 protected:
  FlatOrgan() {
    StereoRig rig;
    rig.image_size = {960, 540};
    rig.left.K = rig.right.K = cv::Matx33d(700, 0, 479.5, 0, 700, 269.5, 0, 0, 1);
    rig.right_from_left_mm = Vec3(-5, 0, 0);
    rectification_ = make_rectification(rig, rig.image_size);
    PointCloud cloud;
    for (double x = -20; x <= 20; x += 0.2)
      for (double y = -20; y <= 20; y += 0.2) {
        cloud.position_mm.emplace_back(x, y, 90);
        cloud.depth_deviation_mm.push_back(0.1f);
      }
    DepthCells cells = make_depth_cells(cloud, 0.3 / 90, {});
    for (int r = 0; r < cells.closed.rows; ++r)
      for (int c = 0; c < cells.closed.cols; ++c)
        if (cells.point_mm({c, r}).x() > 10) cells.closed(r, c) = 255;
    map_.surface = {{{-20, -20, 90}, {20, -20, 90}, {20, 20, 90}, {-20, 20, 90}}, {{0, 2, 1}, {0, 3, 2}}};
    map_.seen = seen_tissue(map_.surface, cells);
    const Surface beside = {{{25, -20, 110}, {45, -20, 110}, {45, 20, 110}, {25, 20, 110}}, {{0, 2, 1}, {0, 3, 2}}};
    map_.pieces = {{map_.surface, {}, 1600, 90}, {beside, {}, 800, 110}};
    map_.mesh = tetrahedralize(close_body(map_.surface, 20), 800, {}, &map_.report.mesh);
  }

  Touchable touchable() const { return {map_, rectification_}; }

  Rectification rectification_;
  TissueMap map_;
};

TEST_F(FlatOrgan, IsHeldWhereItWasSeenAndNowhereElse) {
  const Touchable tissue = touchable();
  EXPECT_TRUE(tissue.may_be_held({0, 0, 90}));
  EXPECT_TRUE(tissue.may_be_held({-19, 5, 90.3}));
  EXPECT_FALSE(tissue.may_be_held({0, 0, 110})) << "the back";
  EXPECT_FALSE(tissue.may_be_held({-20, 0, 100})) << "a side";
  EXPECT_FALSE(tissue.may_be_held({16, 0, 90})) << "behind the instrument";
}

TEST_F(FlatOrgan, IsHeldBehindTheInstrumentOnceThatHasLeft) {
  Touchable tissue = touchable();
  tissue.look(cv::Mat(540, 960, CV_8U, cv::Scalar(255)));
  EXPECT_FALSE(tissue.may_be_held({16, 0, 90}));
  tissue.look(cv::Mat(540, 960, CV_8U, cv::Scalar(0)));
  EXPECT_TRUE(tissue.may_be_held({16, 0, 90}));
}

TEST_F(FlatOrgan, OnlySeenFacesAreDrawn) {
  const std::vector<Triangle> boundary = boundary_triangles(map_.mesh);
  const std::vector<Triangle> drawn = touchable().seen_faces(map_.mesh.nodes_mm, boundary);
  ASSERT_FALSE(drawn.empty());
  EXPECT_LT(drawn.size(), boundary.size());
  for (const Triangle& face : drawn)
    for (int node : face) EXPECT_LT(map_.mesh.nodes_mm[static_cast<size_t>(node)].z(), 99);
}

TEST_F(FlatOrgan, OtherTissueIsTouchedAndNotHeld) {
  const Touchable tissue = touchable();
  EXPECT_TRUE(tissue.is_on_other_tissue({35, 0, 109.5}, 1));
  EXPECT_FALSE(tissue.is_on_other_tissue({35, 0, 105}, 1));
  EXPECT_FALSE(tissue.is_on_other_tissue({0, 0, 89.5}, 1));
  EXPECT_FALSE(tissue.may_be_held({35, 0, 110}));
}

TEST_F(FlatOrgan, APatchAtItsRimReachesOverTheEdge) {
  const Touchable tissue = touchable();
  EXPECT_EQ(tissue.beyond_edge({0, 0, 90}, 3), 0);
  EXPECT_NEAR(tissue.beyond_edge({0, 18.5, 90}, 3), 0.5, 0.15);
}

TEST_F(FlatOrgan, OfAScanIsHeldEverywhere) {
  map_.is_given = true;
  EXPECT_TRUE(touchable().may_be_held({0, 0, 110}));
  EXPECT_EQ(touchable().beyond_edge({0, 19.5, 90}, 3), 0);
}

}  // namespace
}  // namespace palpate
