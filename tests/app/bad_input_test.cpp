#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

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
    const auto answer = nlohmann::json::parse(outcome.output);
    EXPECT_FALSE(answer["ok"].get<bool>());
    EXPECT_EQ(answer["exit_code"].get<int>(), 3);
    EXPECT_EQ("palpate: " + answer["error"].get<std::string>() + "\n", outcome.error);
    return outcome.error;
  }

  void spoil_scene(const std::string& from, const std::string& to) { replace_in_file(in("scene.yaml"), from, to); }

  Workspace workspace_;
};

TEST_F(BadInput, AMissingVideoIsNamed) {
  std::filesystem::remove(in("right.avi"));
  EXPECT_THAT(complaint(), HasSubstr("right.avi"));
}

TEST_F(BadInput, ResultsDoNotReplaceWhatTheSceneReads) {
  const std::string map = "map " + in("scene.yaml").string() + " -o " + (workspace_ / "").string();
  ASSERT_EQ(run_palpate(map + "in").exit_code, 0);
  const std::string body = read_file(in("map.vtu"));
  spoil_scene("thickness_mm: 15", "volume: map.vtu");
  const Outcome outcome = run_palpate(map + "in");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.error, AllOf(HasSubstr("in/map.vtu"), HasSubstr("expected another folder")));
  EXPECT_EQ(read_file(in("map.vtu")), body);
  EXPECT_EQ(run_palpate(map + "elsewhere").exit_code, 0);
}

TEST_F(BadInput, CheckSaysThatANetworkIsMissingBeforeAnythingRuns) {
  spoil_scene("segmentation: colour", "segmentation: mine.onnx");
  const Outcome outcome = run_palpate("check " + in("scene.yaml").string());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.error, HasSubstr("mine.onnx"));
}

TEST_F(BadInput, AnEmptyVideoIsNamed) {
  write_file(in("left.avi"), "");
  EXPECT_THAT(complaint(), HasSubstr("left.avi"));
}

TEST_F(BadInput, AFrameWithoutItsRightPictureIsARowThatSaysSo) {
  write_avi(in("right.avi"), {plane_pair(0).right, plane_pair(1).right});
  const Outcome outcome =
      run_palpate("estimate " + in("scene.yaml").string() + " -o " + (workspace_ / "out").string() + " --json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
  const std::string rows = read_file(workspace_ / "out" / "forces.csv");
  EXPECT_THAT(rows.substr(rows.rfind("\n2,")), AllOf(HasSubstr("tool_lost"), HasSubstr("camera_missing")));
}

TEST_F(BadInput, AVideoThatIsCutIsFoundByACheckBeforeARunFindsIt) {
  std::filesystem::resize_file(in("right.avi"), std::filesystem::file_size(in("right.avi")) * 4 / 5);
  const Outcome outcome = run_palpate("check " + in("scene.yaml").string());
  EXPECT_EQ(outcome.exit_code, 4) << outcome.output;
  EXPECT_THAT(outcome.error, HasSubstr("right.avi ends after 2 frames, its header states"));
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

TEST_F(BadInput, AnOrganRegionOutsideTheImageIsNamedWithItsSizeAndThatOfTheImage) {
  spoil_scene("[[40, 30], [300, 30], [300, 210], [40, 210]]", "[[400, 30], [900, 30], [900, 500], [400, 500]]");
  EXPECT_THAT(complaint(),
              AllOf(HasSubstr("scene.yaml: map.organ_region_px"), HasSubstr("(900, 500)"), HasSubstr("320x240")));
}

TEST_F(BadInput, AnOrganRegionAlongTheBorderIsFine) {
  spoil_scene("[[40, 30], [300, 30], [300, 210], [40, 210]]", "[[0, 0], [320, 0], [320, 240], [-1, 240]]");
  EXPECT_EQ(run_palpate("check " + in("scene.yaml").string()).exit_code, 0);
}

TEST_F(BadInput, TheSameFileForBothEyesIsNoticed) {
  spoil_scene("right: right.avi", "right: ../in/left.avi");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("recording.left and recording.right are the same"), HasSubstr("left.avi")));
}

TEST_F(BadInput, AFolderInPlaceOfAVideoIsToldAsSuch) {
  spoil_scene("left: left.avi", "left: .");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("recording.left"), HasSubstr("is a folder")));
}

TEST_F(BadInput, TheStageThatFailsIsToldWithTheSceneFile) {
  spoil_scene("underside: {depth_mm: 3}", "sphere: {center_mm: [0, 0, 900], radius_mm: 5}");
  EXPECT_THAT(complaint(), HasSubstr(in("scene.yaml").string() + ": attachments"));
  write_file(in("calibration.yaml"), std::string("\0\1\2\xff", 4));
  EXPECT_THAT(complaint(), HasSubstr(in("scene.yaml").string() + ": recording.calibration: "));
}

TEST_F(BadInput, AKeyOfTheDesignThatIsNotThereYetIsToldAsSuch) {
  spoil_scene("{segmentation: colour}", "[{segmentation: colour}, {segmentation: colour}]");
  EXPECT_THAT(complaint(), HasSubstr("instrument[1] is not available yet"));
}

TEST_F(BadInput, ARotationOfARobotThatIsNoneIsNamed) {
  spoil_scene("segmentation: colour", "camera_from_robot: {rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}");
  EXPECT_THAT(complaint(), HasSubstr("instrument.camera_from_robot.rotation is no rotation"));
}

TEST_F(BadInput, AnOrganRegionWithNothingToMatchIsNoticed) {
  spoil_scene("[[40, 30], [300, 30], [300, 210], [40, 210]]", "[[40, 30], [44, 30], [44, 34], [40, 34]]");
  EXPECT_THAT(complaint(), HasSubstr("scene.yaml: map"));
}

TEST_F(BadInput, ACoveredEyeIsNoticed) {
  const cv::Mat black(240, 320, CV_8UC3, cv::Scalar::all(2));
  write_avi(in("right.avi"), {black, black, black});
  EXPECT_THAT(complaint(), HasSubstr("scene.yaml: map"));
}

TEST_F(BadInput, ABrokenVolumeFileIsNamed) {
  write_file(in("organ.msh"), "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n7\n1 0 0");
  spoil_scene("thickness_mm: 15", "volume: organ.msh");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("map.volume"), HasSubstr("organ.msh")));
}

TEST_F(BadInput, ALabelOutsideTheOrganIsNamed) {
  spoil_scene("thickness_mm: 15",
              "thickness_mm: 15, labels: [{name: tumour, region_px: [[1, 1], [9, 1], [9, 9]], tissue: "
              "{young_modulus_kPa: 80}}]");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("map.labels"), HasSubstr("'tumour'")));
}

TEST_F(BadInput, AMaskOfAnotherSizeIsNamed) {
  cv::imwrite(in("mask.png").string(), cv::Mat(100, 100, CV_8U, cv::Scalar(255)));
  spoil_scene("thickness_mm: 15",
              "thickness_mm: 15, labels: [{name: tumour, mask: mask.png, tissue: {young_modulus_kPa: 80}}]");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("mask.png"), HasSubstr("100x100"), HasSubstr("320x240")));
}

TEST_F(BadInput, AFocusOutsideTheOrganIsNamed) {
  spoil_scene("thickness_mm: 15", "thickness_mm: 15, focus_px: [[1, 1], [9, 1], [9, 9]]");
  EXPECT_THAT(complaint(), HasSubstr("map.focus_px"));
}

TEST_F(BadInput, FramesToFuseThatRunBackwardsAreRefused) {
  spoil_scene("frame: 0", "frames: [5, 2]");
  EXPECT_THAT(complaint(), HasSubstr("map.frames is [5, 2]"));
}

TEST_F(BadInput, ANetworkThatIsNotThereIsNamed) {
  spoil_scene("thickness_mm: 15", "thickness_mm: 15, matcher: net.onnx");
  EXPECT_THAT(complaint(), HasSubstr("net.onnx"));
}

TEST_F(BadInput, RegisteringWithoutAVolumeIsRefused) {
  spoil_scene("thickness_mm: 15", "thickness_mm: 15, register: true");
  EXPECT_THAT(complaint(), HasSubstr("map.register needs map.volume"));
}

TEST_F(BadInput, AMissingTipTrackIsNoticedBeforeTheMapIsBuilt) {
  spoil_scene("segmentation: colour", "track: none.csv");
  EXPECT_THAT(complaint(), AllOf(HasSubstr("instrument.track"), HasSubstr("none.csv")));
}

TEST_F(BadInput, AMissingSceneFileIsNamedAsItWasGiven) {
  const Outcome outcome = run_palpate("check no/such/scene.yaml");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(outcome.error, "palpate: no/such/scene.yaml does not exist, expected a YAML scene file\n");
}

TEST_F(BadInput, AnOutputFolderThatCannotBeMadeIsRefusedBeforeTheWorkBegins) {
  const std::string file = in("left.avi").string();
  write_file(in("simulated.yaml"),
             "simulate: {gesture: [{approach_s: 1, at_px: [480, 270]}]}\ntissue: {preset: liver}\n");
  const std::string before = read_file(file);
  for (const std::string& folder : {file, file + "/deeper", std::string("/proc/palpate"), std::string("''")})
    for (const std::string& verb : {"estimate " + in("scene.yaml").string(), "map " + in("scene.yaml").string(),
                                    "simulate " + in("simulated.yaml").string(), std::string("demo")}) {
      const Outcome outcome = run_palpate(verb + " -o " + folder);
      EXPECT_EQ(outcome.exit_code, 3) << verb << " -o " << folder << ": " << outcome.error;
      EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
      EXPECT_THAT(outcome.error, HasSubstr(folder == "''" ? "output folder" : folder));
    }
  EXPECT_EQ(read_file(file), before);
}

TEST_F(BadInput, AnImageThatSpoilsOnTheWayEndsWithFourAndKeepsWhatIsDone) {
  for (int frame = 0; frame < 4; ++frame) {
    cv::imwrite(in("l_" + std::to_string(frame) + ".png").string(), plane_pair(frame).left);
    cv::imwrite(in("r_" + std::to_string(frame) + ".png").string(), plane_pair(frame).right);
  }
  write_file(in("r_2.png"), "no picture");
  spoil_scene("left: left.avi, right: right.avi", "left: l_%d.png, right: r_%d.png");
  const Outcome outcome =
      run_palpate("estimate " + in("scene.yaml").string() + " -o " + (workspace_ / "out").string() + " --json");
  EXPECT_EQ(outcome.exit_code, 4) << outcome.error;
  EXPECT_THAT(outcome.error, AllOf(HasSubstr("r_2.png"), HasSubstr("2 frames are kept")));
  EXPECT_EQ(nlohmann::json::parse(outcome.output)["exit_code"].get<int>(), 4);
  EXPECT_TRUE(std::filesystem::exists(workspace_ / "out/report.html"));
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
