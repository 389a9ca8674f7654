#include "palpate/estimate/check_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "palpate/core/errors.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

/// A wall measured 80 mm in front of a pair with 700 px focal length and 5 mm baseline.
struct Wall {
  Rectification rectification;
  DisparityMap disparity;
  cv::Mat organ_mask;

  Wall() {
    rectification.size = {960, 540};
    rectification.focal_px = 700;
    rectification.principal_x_px = 480;
    rectification.principal_y_px = 270;
    rectification.baseline_mm = 5;
    disparity.disparity_px = cv::Mat(rectification.size, CV_32F, cv::Scalar(rectification.disparity_px(80)));
    organ_mask = cv::Mat(rectification.size, CV_8U, cv::Scalar(255));
  }

  /// What is said against a 40 x 30 x 20 mm block whose front lies at this depth; empty when nothing is.
  std::string against_block_at(double depth_mm, double sideways_mm = 0, double scale = 1) const {
    const TetMesh mesh = test::box_mesh({40, 30, 20}, {4, 3, 2});
    Surface body = without_unused_vertices({mesh.nodes_mm, boundary_triangles(mesh)});
    for (Vec3& v : body.vertices_mm) v = scale * (v + Vec3(sideways_mm - 20, -15, depth_mm));
    try {
      require_body_where_seen(body, disparity, rectification, organ_mask, "organ.stl");
    } catch (const BadInput& sentence) {
      return sentence.what();
    }
    return "";
  }
};

TEST(GivenBody, IsTakenWhereItsFrontLiesOnTheMeasuredTissue) {
  EXPECT_EQ(Wall().against_block_at(80), "");
  EXPECT_EQ(Wall().against_block_at(84), "");
}

TEST(GivenBody, IsRefusedFarBehindOrBeforeTheMeasuredTissue) {
  EXPECT_THAT(Wall().against_block_at(120), testing::HasSubstr("organ.stl lies 40 mm behind the measured tissue"));
  EXPECT_THAT(Wall().against_block_at(50), testing::HasSubstr("30 mm in front of the measured tissue"));
}

TEST(GivenBody, IsRefusedOutOfViewAndInTheWrongUnit) {
  EXPECT_THAT(Wall().against_block_at(80, 200), testing::HasSubstr("outside of the measured tissue"));
  EXPECT_THAT(Wall().against_block_at(80, 0, 0.001), testing::HasSubstr("volume_unit"));
  EXPECT_THAT(Wall().against_block_at(80, 0, 1000), testing::HasSubstr("volume_unit"));
}

TEST(Pieces, EachOfThemHasToBeHeld) {
  TetMesh mesh = test::box_mesh({10, 10, 10}, {2, 2, 2});
  const std::vector<int> below = test::nodes_at(mesh, 2, 0);
  EXPECT_NO_THROW(require_every_piece_held(mesh, below));
  const auto first = static_cast<int>(mesh.nodes_mm.size());
  const TetMesh other = mesh;
  for (const Vec3& node : other.nodes_mm) mesh.nodes_mm.push_back(node + Vec3(50, 0, 0));
  for (const Tetrahedron& t : other.tetrahedra)
    mesh.tetrahedra.push_back({t[0] + first, t[1] + first, t[2] + first, t[3] + first});
  EXPECT_THROW(require_every_piece_held(mesh, below), BadInput);
  std::vector<int> both = below;
  both.push_back(first);
  EXPECT_NO_THROW(require_every_piece_held(mesh, both));
}

}  // namespace
}  // namespace palpate
