#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "palpate/core/mesh_files.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/feedback/warnings.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/stereo/rig.h"
#include "tests/app/program.h"
#include "tests/support/reference_data.h"

namespace palpate::test {
namespace {

using testing::HasSubstr;

int frames_in(const std::filesystem::path& video) {
  cv::VideoCapture capture(video.string());
  int frames = 0;
  for (cv::Mat image; capture.read(image);) ++frames;
  return frames;
}

TEST(Program, WithoutAVerbItSaysWhatItCanDoAndEndsWithTwo) {
  const Outcome outcome = run_palpate("");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.error, HasSubstr("estimate"));
}

TEST(Program, EveryVerbHasHelpWithAnExample) {
  for (const char* verb :
       {"demo", "simulate", "map", "estimate", "compare", "check", "modulus", "study", "console", "benchmark export"}) {
    const Outcome outcome = run_palpate(std::string(verb) + " --help");
    EXPECT_EQ(outcome.exit_code, 0) << verb;
    EXPECT_THAT(outcome.output, HasSubstr("Example: palpate")) << verb;
  }
}

TEST(Program, HelpSaysWhereAPathIsMeant) {
  EXPECT_THAT(run_palpate("estimate --help").output,
              testing::AllOf(HasSubstr("scene SCENE"), HasSubstr("FOLDER"), HasSubstr("--truth FILE")));
  for (const char* verb :
       {"demo", "simulate", "map", "estimate", "compare", "check", "modulus", "study", "console", "benchmark export"})
    EXPECT_THAT(run_palpate(std::string(verb) + " --help").output, testing::Not(HasSubstr("TEXT"))) << verb;
}

TEST(Program, WrongUseIsAlsoAnsweredInJson) {
  const Outcome outcome = run_palpate("estimate --json");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(nlohmann::json::parse(outcome.output)["exit_code"].get<int>(), 2);
}

TEST(Program, CheckTellsWhatItReadInJson) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 3);
  const Outcome outcome = run_palpate("check " + (workspace / "in/scene.yaml").string() + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_TRUE(json["ok"].get<bool>());
  EXPECT_EQ(json["recording"]["image_size_px"], nlohmann::json({320, 240}));
  EXPECT_EQ(json["recording"]["fps"], 25);
  EXPECT_EQ(json["recording"]["frames"], 3);
  EXPECT_EQ(json["calibration"]["focal_px"], 300);
  EXPECT_EQ(json["calibration"]["baseline_mm"], 5);
  EXPECT_NEAR(json["calibration"]["field_of_view_deg"][0], 2 * std::atan(160. / 300) * 180 / M_PI, 1e-9);
  EXPECT_EQ(json["attachments"], nlohmann::json({"underside"}));
  EXPECT_EQ(json["tissue"]["law"], "saint-venant-kirchhoff");
  EXPECT_EQ(json["tissue"]["young_modulus_kPa"], 27);
}

TEST(Program, CheckNamesTheLawThatAPushNeeds) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 3);
  const auto scene = workspace / "in/scene.yaml";
  EXPECT_THAT(run_palpate("check " + scene.string()).output, testing::Not(HasSubstr("advice")));
  replace_in_file(scene, "grip: grasp", "grip: push");
  EXPECT_THAT(run_palpate("check " + scene.string()).output,
              testing::AllOf(HasSubstr("advice: tissue.law"), HasSubstr("neo-hookean")));
}

TEST(Program, CheckSaysWhyAVideoWithoutInstrumentCannotPlaceATipTrack) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 3);
  replace_in_file(workspace / "in/scene.yaml", "segmentation: colour", "track: tip.csv");
  write_file(workspace / "in/tip.csv", "frame,time_s,x_mm,y_mm,z_mm\n0,0,1,2,90\n1,0.04,1,3,90\n");
  const Outcome outcome = run_palpate("check " + (workspace / "in/scene.yaml").string() + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto track = nlohmann::json::parse(outcome.output)["track"];
  EXPECT_NE(track["why_not"].get<std::string>().find("the video shows the tip in 0 frames"), std::string::npos);
  EXPECT_FALSE(track.contains("time_offset_s"));
}

TEST(Program, ConsoleRefusesWhatItCannotOpenWithThree) {
  const Workspace workspace;
  const Outcome no_scene = run_palpate("console --port 0 --root /tmp " + (workspace / "none.yaml").string());
  EXPECT_EQ(no_scene.exit_code, 3);
  EXPECT_THAT(no_scene.error, HasSubstr("does not exist, expected a YAML scene file"));
  const Outcome no_root = run_palpate("console --port 0 --root " + (workspace / "none").string());
  EXPECT_EQ(no_root.exit_code, 3);
  EXPECT_THAT(no_root.error, HasSubstr("--root"));
  const Outcome no_address = run_palpate("console --port 0 --bind nowhere --root /tmp");
  EXPECT_EQ(no_address.exit_code, 3);
  EXPECT_THAT(no_address.error, HasSubstr("--bind is 'nowhere'"));
}

TEST(Program, WrongUseEndsWithTwo) {
  EXPECT_EQ(run_palpate("estimate").exit_code, 2);
  EXPECT_EQ(run_palpate("estimate a.yaml --colour red").exit_code, 2);
  EXPECT_EQ(run_palpate("fly").exit_code, 2);
}

TEST(Program, MapWritesEveryFileOfTheContract) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 2);
  const Outcome outcome =
      run_palpate("map " + (workspace / "in/scene.yaml").string() + " -o " + (workspace / "out").string() + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  for (const char* name : {"map.vtu", "surface.ply", "cloud.ply", "preview.png", "map.json"})
    EXPECT_TRUE(std::filesystem::exists(workspace / "out" / name)) << name;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_TRUE(json["ok"].get<bool>());
  EXPECT_EQ(json["folder"], (workspace / "out").string());
  EXPECT_FALSE(cv::imread((workspace / "out/preview.png").string()).empty());
}

TEST(Program, AVideoWithoutInstrumentIsToolLostInEveryFrame) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 4);
  const Outcome outcome = run_palpate("estimate " + (workspace / "in/scene.yaml").string() + " -o " +
                                      (workspace / "out").string() + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const std::vector<ForceRow> rows = read_forces(workspace / "out/forces.csv");
  ASSERT_EQ(rows.size(), 4u);
  for (const ForceRow& row : rows) {
    EXPECT_EQ(row.status, "tool_lost");
    EXPECT_EQ(row.force_magnitude_N, 0);
  }
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_TRUE(json["ok"].get<bool>());
  EXPECT_EQ(json["folder"], (workspace / "out").string());
  EXPECT_EQ(json["tissue"]["poisson_ratio"], 0.45);
  EXPECT_EQ(json["peak_force_per_modulus_N_per_kPa"], 0);
  EXPECT_EQ(json["frames_by_status"]["tool_lost"], 4);
  EXPECT_EQ(frames_in(workspace / "out/overlay.mp4"), 4);
  EXPECT_THAT(read_file(workspace / "out/run.yaml"), HasSubstr("thickness_mm: 15"));
}

TEST(Program, SettingsInEffectReadBackAsAScene) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 2);
  ASSERT_EQ(run_palpate("estimate " + (workspace / "in/scene.yaml").string() + " -o " + (workspace / "out").string())
                .exit_code,
            0);
  const Outcome again = run_palpate("check " + (workspace / "out/run.yaml").string() + " --json");
  EXPECT_EQ(again.exit_code, 0) << again.error;
}

TEST(Program, ATruncatedVideoEndsWithFourAndKeepsWhatIsDone) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 40);
  const std::filesystem::path video = workspace / "in/right.avi";
  std::filesystem::resize_file(video, std::filesystem::file_size(video) * 3 / 4);
  const Outcome outcome = run_palpate("estimate " + (workspace / "in/scene.yaml").string() + " -o " +
                                      (workspace / "out").string() + " --json");
  EXPECT_EQ(outcome.exit_code, 4) << outcome.error;
  const size_t rows = read_forces(workspace / "out/forces.csv").size();
  EXPECT_GT(rows, 20u);
  EXPECT_LT(rows, 40u);
  EXPECT_EQ(static_cast<size_t>(frames_in(workspace / "out/overlay.mp4")), rows);
  EXPECT_TRUE(std::filesystem::exists(workspace / "out/report.html"));
}

TEST(Program, CompareAnswersInJson) {
  const Workspace workspace;
  write_file(workspace / "truth.csv",
             "frame,time_s,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm\n"
             "0,0,0,0,0,0,0,1,2,90\n1,0.04,1,0,0,-2,2,1,2,90\n");
  write_file(workspace / "forces.csv",
             "frame,time_s,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm\n"
             "0,0,0,0,0,0,0,1,2,91\n1,0.04,1,0,0,-1,1,1,2,91\n");
  const Outcome outcome = run_palpate("compare " + (workspace / "forces.csv").string() + " " +
                                      (workspace / "truth.csv").string() + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_NEAR(json["force_nrmse_pct"].get<double>(), 100 * std::sqrt(0.5) / 2, 1e-9);
  EXPECT_NEAR(json["tip_rmse_mm"].get<double>(), 1, 1e-9);
}

TEST(Program, TheDemoMeetsItsGoals) {
  const Workspace workspace;
  const Outcome outcome = run_palpate("demo -o " + (workspace / "demo").string() + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_NEAR(json["peak_force_per_modulus_N_per_kPa"].get<double>(), json["peak_force_N"].get<double>() / 400, 1e-9);
  EXPECT_GE(json["frames"].get<int>(), 100);
  const auto& figures = json["comparison"];
  EXPECT_EQ(figures["missing_frames"].get<int>(), 0);
  EXPECT_LE(figures["force_nrmse_pct"].get<double>(), 25);
  EXPECT_LE(std::abs(figures["onset_error_frames"].get<int>()), 5);
  EXPECT_LE(figures["tip_rmse_mm"].get<double>(), 2);
  for (const char* name : {"forces.csv", "overlay.mp4", "map.vtu", "surface.ply", "report.html", "shapes.bin"})
    EXPECT_TRUE(std::filesystem::exists(workspace / "demo" / name)) << name;
}

TEST(Readme, ItsExampleIsTheOneThatIsCompiledAndItRuns) {
  const std::filesystem::path source = PALPATE_SOURCE_DIR;
  EXPECT_THAT(read_file(source / "README.md"), HasSubstr(read_file(source / "examples/forces.cpp")));
  const Workspace workspace;
  write_plane_recording(workspace / "in", 4);
  const Outcome outcome = run(PALPATE_EXAMPLE_FORCES, (workspace / "in/scene.yaml").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_EQ(outcome.output, "1 tool_lost 0.000 N\n2 tool_lost 0.000 N\n3 tool_lost 0.000 N\n");
}

TEST(ElasticPage, ItsExampleIsTheOneThatIsCompiledAndItRuns) {
  const std::filesystem::path source = PALPATE_SOURCE_DIR;
  EXPECT_THAT(read_file(source / "docs/elastic.md"), HasSubstr(read_file(source / "examples/punch.cpp")));
  const Workspace workspace;
  SimulatedBody body;
  body.shape = "pear";
  body.size_mm = {62, 48, 44};
  write_ply(workspace / "organ.ply", make_organ(body, 2000));
  const Outcome outcome = run(PALPATE_EXAMPLE_PUNCH, (workspace / "organ.ply").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
  double force_N[4] = {};
  ASSERT_EQ(std::sscanf(outcome.output.c_str(),
                        "0.5 mm: %lf N, a little deeper %*f N/mm more\n1.0 mm: %lf N, a little deeper %*f N/mm more\n"
                        "1.5 mm: %lf N, a little deeper %*f N/mm more\n2.0 mm: %lf N",
                        &force_N[0], &force_N[1], &force_N[2], &force_N[3]),
            4)
      << outcome.output;
  EXPECT_GT(force_N[3], 4 * force_N[0]);
}

TEST(Program, TheScenePageIsWhatTheProgramSaysOfItself) {
  const std::string page = read_file(std::filesystem::path(PALPATE_SOURCE_DIR) / "docs/scene.md");
  const Outcome outcome = run_palpate("--document-scene");
  ASSERT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(page, HasSubstr(outcome.output)) << "docs/scene.md is behind: run ./dev docs";
}

TEST(Program, DocumentsItsInputsAsTheReadersListThem) {
  const std::string page = read_file(std::filesystem::path(PALPATE_SOURCE_DIR) / "docs/inputs.md");
  const Outcome outcome = run_palpate("--document-inputs");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(page, outcome.output) << "docs/inputs.md is behind: run ./dev docs";
}

/// Every name that a line of the library adds to the warnings of a frame.
std::set<std::string> warnings_in_the_code() {
  static const std::regex kAdded("warnings\\.(push_back|emplace_back)\\(\"([a-z_]+)\"\\)");
  std::set<std::string> names;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(std::filesystem::path(PALPATE_SOURCE_DIR) / "palpate")) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string source = read_file(entry.path());
    for (std::sregex_iterator found(source.begin(), source.end(), kAdded), end; found != end; ++found)
      names.insert((*found)[2]);
  }
  return names;
}

TEST(OutputsPage, NamesEveryColumnStatusAndWarning) {
  const std::string page = read_file(std::filesystem::path(PALPATE_SOURCE_DIR) / "docs/outputs.md");
  const std::set<std::string> warnings = warnings_in_the_code();
  ASSERT_TRUE(warnings.count("law_out_of_range"));
  for (const std::string& name : warnings) {
    EXPECT_THAT(page, HasSubstr("| `" + name + "` | " + warning_words(name)));
    EXPECT_NE(warning_words(name), name) << "has no words in palpate/feedback/warnings.cpp";
  }
  for (const FrameStatus status : {FrameStatus::ok, FrameStatus::no_contact, FrameStatus::tool_lost,
                                   FrameStatus::not_converged, FrameStatus::map_stale})
    EXPECT_THAT(page, HasSubstr("| `" + status_name(status) + "`"));
  const Workspace workspace;
  { const ForcesWriter header_only(workspace / "forces.csv"); }
  std::stringstream columns(read_file(workspace / "forces.csv"));
  for (std::string column; std::getline(columns, column, ',');)
    EXPECT_THAT(page, HasSubstr("`" + column.substr(0, column.find('\n')) + "`"));
}

TEST(ScenePage, ShowsACalibrationThatIsRead) {
  const std::string page = read_file(std::filesystem::path(PALPATE_SOURCE_DIR) / "docs/scene.md");
  const size_t begin = page.find("%YAML:1.0");
  ASSERT_NE(begin, std::string::npos);
  const Workspace workspace;
  write_file(workspace / "calibration.yaml", page.substr(begin, page.find("```", begin) - begin));
  const StereoRig rig = read_rig(workspace / "calibration.yaml");
  EXPECT_EQ(rig.baseline_mm(), 5);
  EXPECT_EQ(rig.image_size, cv::Size(960, 540));
}

}  // namespace
}  // namespace palpate::test
