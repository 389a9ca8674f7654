#include "palpate/volume/attachments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "palpate/core/errors.h"
#include "tests/volume/shapes.h"

namespace palpate {
namespace {

using namespace palpate::test;
using Kind = AttachmentRegion::Kind;

/// 20 mm cube before the camera, nodes every 5 mm.
TetMesh cube() {
  return block({-10, -10, 90}, 20, 4);
}

cv::Point2d project(const Vec3& p) {
  return {700 * p.x() / p.z() + 480, 700 * p.y() / p.z() + 270};
}

std::vector<int> nodes_where(const TetMesh& mesh, const std::function<bool(const Vec3&)>& holds) {
  std::vector<int> nodes;
  for (size_t i = 0; i < mesh.nodes_mm.size(); ++i)
    if (holds(mesh.nodes_mm[i])) nodes.push_back(static_cast<int>(i));
  return nodes;
}

AttachmentOptions read(const std::string& yaml) {
  AttachmentOptions options;
  Settings scene;
  describe(scene, options);
  read_settings(YAML::Load(yaml), {"scene.yaml", "."}, scene);
  return options;
}

TEST(Attachments, UndersideIsWhatLooksAwayFromTheCamera) {
  const TetMesh mesh = cube();
  EXPECT_EQ(select_attachments(mesh, read("attachments: [{underside: {depth_mm: 1}}]"), project),
            nodes_where(mesh, [](const Vec3& p) { return p.z() > 109; }));
  EXPECT_EQ(select_attachments(mesh, read("attachments: [{underside: {depth_mm: 6}}]"), project),
            nodes_where(mesh, [](const Vec3& p) { return p.z() > 104; }));
}

TEST(Attachments, BoxSphereAndTheirUnion) {
  const TetMesh mesh = cube();
  EXPECT_EQ(
      select_attachments(mesh, read("attachments: [{box: {min_mm: [-11, -11, 89], max_mm: [-9, 11, 111]}}]"), project),
      nodes_where(mesh, [](const Vec3& p) { return p.x() < -9; }));
  EXPECT_EQ(
      select_attachments(mesh, read("attachments: [{sphere: {center_mm: [10, 10, 110], radius_mm: 5.1}}]"), project)
          .size(),
      4u);
  EXPECT_EQ(select_attachments(mesh,
                               read("attachments:\n  - box: {min_mm: [-11, -11, 89], max_mm: [-9, 11, 111]}\n"
                                    "  - sphere: {center_mm: [10, 10, 110], radius_mm: 5.1}\n"),
                               project)
                .size(),
            29u);
}

TEST(Attachments, OrientedBoxHasItsAxesInRows) {
  const TetMesh mesh = cube();
  // Axes turned by 30 degrees about z; the half-space x' > 0 of a large box.
  const AttachmentOptions options = read(
      "attachments: [{oriented_box: {center_mm: [43.3013, 25, 100], half_size_mm: [50, 100, 100], "
      "axes: [[0.8660, 0.5, 0], [-0.5, 0.8660, 0], [0, 0, 1]]}}]");
  EXPECT_EQ(select_attachments(mesh, options, project),
            nodes_where(mesh, [](const Vec3& p) { return 0.8660 * p.x() + 0.5 * p.y() >= -1e-3; }));
}

TEST(Attachments, PolygonReachesThroughTheWholeDepth) {
  const TetMesh mesh = cube();
  EXPECT_EQ(
      select_attachments(mesh, read("attachments: [{polygon_px: [[0, 0], [482, 0], [482, 540], [0, 540]]}]"), project),
      nodes_where(mesh, [](const Vec3& p) { return p.x() <= 0; }));
}

TEST(Attachments, AnItemNamesExactlyOneRegion) {
  EXPECT_THROW(read("attachments: [{underside: {depth_mm: 1}, sphere: {center_mm: [0, 0, 1], radius_mm: 1}}]"),
               BadInput);
  EXPECT_THROW(read("attachments: [{}]"), BadInput);
  EXPECT_THROW(read("attachments: [{ball: {center_mm: [0, 0, 1], radius_mm: 1}}]"), BadInput);
  EXPECT_THROW(read("attachments: [{sphere: {radius_mm: 1}}]"), BadInput);
  EXPECT_THROW(read("attachments: [{box: {min_mm: [0, 0, 1], max_mm: [0, 1, 2]}}]"), BadInput);
  EXPECT_THROW(read("attachments: [{oriented_box: {center_mm: [0, 0, 1], half_size_mm: [1, 1, 1], "
                    "axes: [[1, 0, 0], [1, 0, 0], [0, 0, 1]]}}]"),
               BadInput);
}

TEST(Attachments, WhatIsWrittenReadsBackTheSame) {
  AttachmentOptions options = read(
      "attachments:\n  - underside: {depth_mm: 2}\n  - sphere: {center_mm: [1, 2, 3], radius_mm: 4}\n"
      "  - polygon_px: [[1, 2], [3, 4], [5, 7]]\n");
  Settings scene;
  describe(scene, options);
  const AttachmentOptions again = read(write_settings(scene));
  ASSERT_EQ(again.regions.size(), 3u);
  EXPECT_EQ(again.regions[0].kind, Kind::underside);
  EXPECT_EQ(again.regions[0].depth_mm, 2);
  EXPECT_EQ(again.regions[1].kind, Kind::sphere);
  EXPECT_EQ(again.regions[1].center_mm, Vec3(1, 2, 3));
  EXPECT_EQ(again.regions[2].kind, Kind::polygon);
  EXPECT_EQ(again.regions[2].polygon_px[2], cv::Point2d(5, 7));
}

TEST(Attachments, NoneOrAllNodesAreBadInputThatSaysWhereTheTissueIs) {
  const TetMesh mesh = cube();
  for (const char* yaml : {"attachments: [{sphere: {center_mm: [0, 0, 500], radius_mm: 1}}]",
                           "attachments: [{sphere: {center_mm: [0, 0, 100], radius_mm: 900}}]", "attachments: []"}) {
    try {
      select_attachments(mesh, read(yaml), project);
      FAIL() << yaml;
    } catch (const BadInput& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("of 125 nodes"));
      EXPECT_THAT(error.what(), testing::HasSubstr("z 90.0..110.0 mm"));
    }
  }
}

}  // namespace
}  // namespace palpate
