#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/app/program.h"

namespace palpate::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A good recording that each test spoils in one way; estimate must then end with exit code 3, one sentence, no output.
class BadInput : public testing::Test {
 protected:
  void SetUp() override { write_plane_recording(workspace_ / "in", 3); }

  std::filesystem::path in(const std::string& name) const { return workspace_ / "in" / name; }

  std::string complaint() const {
    const Outcome outcome =
        run_palpate("estimate " + in("scene.yaml").string() + " -o " + (workspace_ / "out").string() + " --json");
    EXPECT_EQ(outcome.exit_code, 3) << outcome.error;
    EXPECT_FALSE(std::filesystem::exists(workspace_ / "out")) << "something half-written was left behind";
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    return outcome.error;
  }

  void spoil_scene(const std::string& from, const std::string& to) { replace_in_file(in("scene.yaml"), from, to); }

  Workspace workspace_;
};

TEST_F(BadInput, AMissingVideoIsNamed) {
  std::filesystem::remove(in("right.avi"));
  EXPECT_THAT(complaint(), HasSubstr("right.avi"));
}

TEST_F(BadInput, AnEmptyVideoIsNamed) {
  write_file(in("left.avi"), "");
  EXPECT_THAT(complaint(), HasSubstr("left.avi"));
}

TEST_F(BadInput, EyesOfDifferentLengthAreNoticedBeforeAnythingRuns) {
  write_avi(in("right.avi"), {plane_pair(0).right, plane_pair(1).right});
  EXPECT_THAT(complaint(), AllOf(HasSubstr("3"), HasSubstr("2"), HasSubstr("frames")));
}

TEST_F(BadInput, EyesOfDifferentSizeAreNoticed) {
  const cv::Mat small = plane_pair(0).right(cv::Rect(0, 0, 160, 240)).clone();
  write_avi(in("right.avi"), {small, small, small});
  EXPECT_THAT(complaint(), AllOf(HasSubstr("320"), HasSubstr("160")));
}

TEST_F(BadInput, SwappedEyesAreNoticed) {
  spoil_scene("left: left.avi, right: right.avi", "left: right.avi, right: left.avi");
  EXPECT_THAT(complaint(), HasSubstr("swap"));
}

TEST_F(BadInput, ACalibrationForAnotherSizeIsNoticed) {
  replace_in_file(in("calibration.yaml"), "image_width: 320", "image_width: 960");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("calibration.yaml"), HasSubstr("960")));
}

TEST_F(BadInput, APrincipalPointFarFromTheCentreIsNoticedWhereNoSizeIsNamed) {
  replace_in_file(in("calibration.yaml"), "image_width: 320\nimage_height: 240\n", "");
  replace_in_file(in("calibration.yaml"), "159.5", "479.5");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("calibration.yaml"), HasSubstr("principal point")));
}

TEST_F(BadInput, AMisspeltKeyIsNamedWithTheNearestValidOne) {
  spoil_scene("thickness_mm", "thicknes_mm");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("scene.yaml:2"), HasSubstr("thicknes_mm"), HasSubstr("'thickness_mm'")));
}

TEST_F(BadInput, AThicknessOutOfRangeIsNamed) {
  spoil_scene("thickness_mm: 15", "thickness_mm: -2");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("thickness_mm is -2"), HasSubstr("expected")));
}

TEST_F(BadInput, AYoungsModulusOutOfRangeIsNamed) {
  spoil_scene("young_modulus_kPa: 27", "young_modulus_kPa: 1e9");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("young_modulus_kPa"), HasSubstr("expected")));
}

TEST_F(BadInput, APoissonsRatioOfOneHalfIsRefused) {
  spoil_scene("poisson_ratio: 0.45", "poisson_ratio: 0.5");
  EXPECT_THAT(complaint(), HasSubstr("poisson_ratio is 0.5"));
}

TEST_F(BadInput, AttachmentsThatSelectNoNodeAreNoticed) {
  spoil_scene("underside: {depth_mm: 3}", "sphere: {center_mm: [0, 0, 900], radius_mm: 5}");
  EXPECT_THAT(complaint(), HasSubstr("attachments"));
}

TEST_F(BadInput, AttachmentsThatSelectEveryNodeAreNoticed) {
  spoil_scene("underside: {depth_mm: 3}", "sphere: {center_mm: [0, 0, 60], radius_mm: 900}");
  EXPECT_THAT(complaint(), HasSubstr("attachments"));
}

TEST_F(BadInput, AnImageWithoutTextureIsNoticed) {
  const cv::Mat grey(240, 320, CV_8UC3, cv::Scalar(60, 60, 140));
  write_avi(in("left.avi"), {grey, grey, grey});
  write_avi(in("right.avi"), {grey, grey, grey});
  EXPECT_THAT(complaint(), HasSubstr("texture"));
}

TEST_F(BadInput, AMapFrameBeyondTheEndIsNamed) {
  spoil_scene("frame: 0", "frame: 30");
  EXPECT_THAT(complaint(), HasSubstr("map.frame is 30"));
}

TEST_F(BadInput, AnUnsetEnvironmentVariableInAPathIsNamed) {
  spoil_scene("left.avi", "'${PALPATE_NO_SUCH_FOLDER}/left.avi'");
  EXPECT_THAT(complaint(), HasSubstr("PALPATE_NO_SUCH_FOLDER"));
}

TEST_F(BadInput, AMissingTruthFileIsNoticedBeforeAnythingRuns) {
  const Outcome outcome = run_palpate("estimate " + in("scene.yaml").string() + " --truth " + in("none.csv").string() +
                                      " -o " + (workspace_ / "out").string());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.error, HasSubstr("none.csv"));
  EXPECT_FALSE(std::filesystem::exists(workspace_ / "out"));
}

}  // namespace
}  // namespace palpate::test
