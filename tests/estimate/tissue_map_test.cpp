#include "palpate/estimate/tissue_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/mesh_files.h"
#include "palpate/elastic/stress.h"
#include "palpate/estimate/scene.h"
#include "palpate/instrument/instrument_finder.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

/// The rendered uterus: its scene with the true volume, and the first frame.
class RenderedUterus : public testing::Test {
 protected:
  void SetUp() override {
    PALPATE_NEEDS_REFERENCE("rendered_uterus");
    const auto folder = test::reference_data() / "rendered_uterus";
    scene_ = read_scene(folder / "scene.yaml");
    scan_ = read_body(folder / "surface_rest.ply", LengthUnit::mm);
    Recording recording(scene_.recording);
    rectification_ = make_rectification(read_rig(scene_.recording.calibration), recording.size());
    frame_ = *recording.next();
  }

  TissueMap build() const {
    return build_tissue_map(frame_, rectification_, scene_.map, scene_.tissue, scene_.attachments);
  }

  std::string complaint() const {
    try {
      build();
    } catch (const BadInput& sentence) {
      return sentence.what();
    }
    return "";
  }

  /// The scan turned by a quarter of a radian and shifted by four centimetres, as a file that the map is to be made of.
  void give_moved_scan() {
    Surface moved = scan_;
    const Mat3 turn = Eigen::AngleAxisd(0.25, Vec3(0.3, 0.8, 0.5).normalized()).toRotationMatrix();
    for (Vec3& v : moved.vertices_mm) v = turn * v + Vec3(25, -12, 30);
    scene_.map.volume = std::filesystem::path(testing::TempDir()) / "palpate_moved_uterus.ply";
    write_ply(scene_.map.volume, moved);
    scene_.map.register_volume = true;
  }

  bool is_in(const Vec3& p, const cv::Rect& region_px) const {
    return region_px.contains(cv::Point(project_to_recorded_left(rectification_.rig, p)));
  }

  Scene scene_;
  Surface scan_;
  Rectification rectification_;
  StereoFrame frame_;
};

const cv::Rect kRegion_px(380, 200, 100, 100);
const std::vector<cv::Point2d> kCorners_px = {{380, 200}, {480, 200}, {480, 300}, {380, 300}};

TEST_F(RenderedUterus, AScanThatLiesElsewhereIsRegistered) {
  give_moved_scan();
  const TissueMap map = build();
  ASSERT_TRUE(map.report.registration);
  EXPECT_LT(map.report.registration->residual_mm, 0.3);
  EXPECT_GT(map.report.registration->matched_fraction, 0.95);
  const Registration& found = *map.report.registration;
  const Mat3 turn = Eigen::AngleAxisd(0.25, Vec3(0.3, 0.8, 0.5).normalized()).toRotationMatrix();
  double largest = 0;
  for (const Vec3& v : scan_.vertices_mm)
    largest = std::max(largest, (found.apply(turn * v + Vec3(25, -12, 30)) - v).norm());
  EXPECT_LT(largest, 0.6);
}

TEST_F(RenderedUterus, SeveralStillFramesLowerTheDeviationAndTheLastOneIsTheMaps) {
  Recording recording(scene_.recording);
  std::vector<StereoFrame> frames;
  for (int i = 0; i < 6; ++i) frames.push_back(*recording.next());
  const TissueMap one = build();
  const TissueMap fused = build_tissue_map(frames, rectification_, scene_.map, scene_.tissue, scene_.attachments);
  EXPECT_EQ(fused.frame, 5);
  EXPECT_GT(fused.report.coverage, 0.9 * one.report.coverage);
  EXPECT_LT(fused.report.median_depth_deviation_mm, 0.95 * one.report.median_depth_deviation_mm);
}

TEST_F(RenderedUterus, AnInstrumentThatRestsInTheStaticFrameIsNoTissue) {
  Recording recording(scene_.recording);
  for (int i = 0; i < 60; ++i) frame_ = *recording.next();
  InstrumentOptions learned;
  learned.segmentation = "learned";
  const RectifiedPair pair = rectify(rectification_, frame_);
  cv::Mat instrument = InstrumentFinder(learned, pair.left, {}).find(pair.left).mask;
  cv::erode(instrument, instrument, cv::Mat::ones(5, 5, CV_8U));
  const TissueMap map = build();
  instrument &= map.organ_mask;
  ASSERT_GT(cv::countNonZero(instrument), 500);
  const cv::Mat& disparity_px = map.disparity.disparity_px;
  EXPECT_LT(cv::countNonZero((disparity_px == disparity_px) & instrument), 0.02 * cv::countNonZero(instrument));
}

TEST_F(RenderedUterus, AScanThatDoesNotFitIsRefusedWithItsResidual) {
  give_moved_scan();
  scene_.map.register_limit_mm = 0.01;
  EXPECT_THAT(complaint(), testing::AllOf(testing::HasSubstr("map.register: "), testing::HasSubstr("moved_uterus.ply"),
                                          testing::HasSubstr("expected at most 0.01 mm")));
}

TEST_F(RenderedUterus, ElementsAreFinerBehindTheFocusInTheSameNumber) {
  scene_.map.focus_px = kCorners_px;
  const TissueMap map = build();
  EXPECT_NEAR(static_cast<double>(map.mesh.tetrahedra.size()), 1344, 135);
  EXPECT_GE(map.report.mesh.smallest_dihedral_deg, 10);
  double sum[2] = {0, 0};
  int count[2] = {0, 0};
  for (const Triangle& t : boundary_triangles(map.mesh))
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 &a = map.mesh.nodes_mm[static_cast<size_t>(t[k])],
                 &b = map.mesh.nodes_mm[static_cast<size_t>(t[(k + 1) % 3])];
      const Vec3 middle = (a + b) / 2;
      if (middle.z() > 95) continue;
      const int place = is_in(middle, kRegion_px);
      sum[place] += (a - b).norm();
      ++count[place];
    }
  ASSERT_GT(count[1], 20);
  EXPECT_LT(sum[1] / count[1], 0.75 * sum[0] / count[0]);
}

TEST_F(RenderedUterus, AFocusOutsideTheTissueIsRefused) {
  scene_.map.focus_px = {{900, 10}, {950, 10}, {950, 60}};
  EXPECT_THAT(complaint(), testing::HasSubstr("map.focus_px"));
}

TEST_F(RenderedUterus, ALabelMakesTheTissueBehindItStiffer) {
  scene_.map.labels = {{"myoma", kCorners_px, {}, {4000, 0.35}}};
  const TissueMap map = build();
  int labelled = 0;
  for (size_t e = 0; e < map.mesh.tetrahedra.size(); ++e) {
    Vec3 middle = Vec3::Zero();
    for (int node : map.mesh.tetrahedra[e]) middle += map.mesh.nodes_mm[static_cast<size_t>(node)] / 4;
    // The outline itself belongs to the region.
    const bool inside = is_in(middle, kRegion_px), outside = !is_in(middle, kRegion_px + cv::Size(1, 1));
    EXPECT_TRUE(map.mesh.label[e] == 1 ? !outside : !inside);
    labelled += map.mesh.label[e];
  }
  EXPECT_GT(labelled, 30);
  // The assembled stiffness: ten times as large where every element around a node is labelled, unchanged far away.
  TissueOptions plain = map.tissue;
  plain.of_label.clear();
  const TetModel with(map.mesh, map.tissue, map.fixed_nodes), without(map.mesh, plain, map.fixed_nodes);
  Eigen::SparseMatrix<double> stiff, soft;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * with.node_count());
  with.tangent(rest, false, stiff);
  without.tangent(rest, false, soft);
  const Eigen::VectorXd ratio = stiff.diagonal().cwiseQuotient(soft.diagonal());
  EXPECT_NEAR(ratio.maxCoeff(), 10, 1e-6);
  EXPECT_NEAR(ratio.minCoeff(), 1, 1e-9);
}

TEST_F(RenderedUterus, ALabelBesideTheOrganIsRefused) {
  scene_.map.labels = {{"myoma", {{900, 10}, {950, 10}, {950, 60}}, {}, {4000, 0.35}}};
  EXPECT_THAT(complaint(), testing::AllOf(testing::HasSubstr("map.labels"), testing::HasSubstr("'myoma'")));
}

}  // namespace
}  // namespace palpate
