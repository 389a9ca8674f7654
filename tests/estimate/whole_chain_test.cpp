#include <gtest/gtest.h>

#include <fstream>

#include "palpate/feedback/compare.h"
#include "palpate/palpate.h"
#include "palpate/volume/body.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

/// A rendered sequence (forces by CalculiX, pictures by Blender) with its map.
struct Sequence {
  Scene scene;
  Recording recording;
  Rectification rectification;
  StereoFrame rest;
  TissueMap map;

  explicit Sequence(const std::filesystem::path& folder)
      : scene(read_scene(folder / "scene.yaml")),
        recording(scene.recording),
        rectification(make_rectification(read_rig(scene.recording.calibration), recording.size())),
        rest(*recording.next()),
        map(build_tissue_map(rest, rectification, scene.map, scene.tissue, scene.attachments)) {}

  ForceEstimator estimator() const { return ForceEstimator(map, rest, rectification, scene.instrument, scene.contact); }
};

TEST(TissueMap, FollowsTheTrueSurfaceOfTheRenderedOrgans) {
  for (const char* name : {"rendered_uterus", "rendered_liver"}) {
    PALPATE_NEEDS_REFERENCE(name);
    const Sequence sequence(test::reference_data() / name);
    const Surface truth = read_body(test::reference_data() / name / "surface_rest.ply", LengthUnit::mm);
    double squares = 0;
    for (const Vec3& vertex : sequence.map.surface.vertices_mm)
      squares += std::pow(closest_point(vertex, truth.vertices_mm, truth.triangles).distance, 2);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(sequence.map.surface.vertices_mm.size())), 0.4) << name;
    EXPECT_NEAR(static_cast<double>(sequence.map.mesh.tetrahedra.size()), 1344, 135) << name;
    EXPECT_GT(sequence.map.report.mesh.smallest_dihedral_deg, 10) << name;
  }
}

TEST(TissueMap, IsTheSameInEveryRun) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  const Sequence one(test::reference_data() / "rendered_uterus"), other(test::reference_data() / "rendered_uterus");
  EXPECT_EQ(one.map.mesh.tetrahedra, other.map.mesh.tetrahedra);
  EXPECT_EQ(one.map.fixed_nodes, other.map.fixed_nodes);
}

TEST(WholeChain, TheForceOnTheRenderedUterusFollowsTheTruth) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  Sequence sequence(test::reference_data() / "rendered_uterus");
  ForceEstimator estimator = sequence.estimator();
  std::vector<ForceRow> rows = {to_row(estimator.update(sequence.rest))};
  while (const auto frame = sequence.recording.next()) rows.push_back(to_row(estimator.update(*frame)));
  const Comparison figures = compare(rows, read_forces(test::reference_data() / "rendered_uterus" / "truth.csv"));
  EXPECT_EQ(figures.missing_frames, 0);
  EXPECT_LT(figures.force_nrmse_pct.value(), 10);
  EXPECT_LE(std::abs(figures.onset_error_frames.value()), 2);
  EXPECT_LE(std::abs(figures.release_error_frames.value()), 2);
  EXPECT_EQ(figures.false_contact_frames, 0);
  EXPECT_LT(figures.tip_rmse_mm.value(), 2);
}

TEST(WholeChain, JawsThatCloseOnTheTissueBeginTheContactAndJawsThatOpenEndIt) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  Sequence sequence(test::reference_data() / "rendered_uterus");
  const auto truth = read_forces(test::reference_data() / "rendered_uterus" / "truth.csv");
  sequence.scene.instrument.track = std::filesystem::path(testing::TempDir()) / "tip_with_jaws.csv";
  std::ofstream track(sequence.scene.instrument.track);
  track << "frame,time_s,x_mm,y_mm,z_mm,closed\n";
  for (const ForceRow& row : truth)
    track << row.frame << ',' << row.time_s << ',' << row.tip_mm.x() << ',' << row.tip_mm.y() << ',' << row.tip_mm.z()
          << ',' << row.in_contact << '\n';
  track.close();
  ForceEstimator estimator = sequence.estimator();
  std::vector<ForceRow> rows = {to_row(estimator.update(sequence.rest))};
  while (const auto frame = sequence.recording.next()) rows.push_back(to_row(estimator.update(*frame)));
  const Comparison figures = compare(rows, truth);
  EXPECT_EQ(figures.onset_error_frames.value(), 0);
  EXPECT_EQ(figures.release_error_frames.value(), 0);
  EXPECT_LT(figures.force_nrmse_pct.value(), 10);
}

TEST(WholeChain, BadFramesAreAStatusAndTheContactIsFoundAgain) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  Sequence sequence(test::reference_data() / "rendered_uterus");
  ForceEstimator estimator = sequence.estimator();
  double last_force_N = 0;
  while (auto frame = sequence.recording.next()) {
    const bool is_black = frame->index == 8 || frame->index == 26 || frame->index == 27;
    if (is_black) {
      frame->left.setTo(0);
      frame->right.setTo(0);
    }
    const ForceEstimate estimate = estimator.update(*frame);
    EXPECT_TRUE(estimate.force_N.allFinite());
    if (is_black) {
      EXPECT_EQ(status_name(estimate.status), "tool_lost") << frame->index;
      EXPECT_EQ(estimate.force_N.norm(), 0) << frame->index;
    }
    if (frame->index == 12) {
      EXPECT_EQ(status_name(estimate.status), "no_contact");
    }
    if (frame->index == 32) last_force_N = estimate.force_N.norm();
    if (frame->index == 32) break;
  }
  EXPECT_NEAR(last_force_N, 12.8, 2.5);
}

TEST(WholeChain, FramesBeforeTheMapFrameAreNoContact) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  Sequence sequence(test::reference_data() / "rendered_uterus");
  sequence.map.frame = 50;
  ForceEstimator estimator = sequence.estimator();
  while (const auto frame = sequence.recording.next()) {
    const ForceEstimate estimate = estimator.update(*frame);
    EXPECT_FALSE(estimate.in_contact) << frame->index;
    if (frame->index == 30) break;
  }
}

}  // namespace
}  // namespace palpate
