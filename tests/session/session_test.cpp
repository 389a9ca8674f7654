#include "palpate/session/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>

#include "palpate/core/errors.h"
#include "palpate/session/scene_text.h"
#include "palpate/session/shape.h"
#include "tests/session/session_test_base.h"
#include "tests/support/plane_recording.h"

namespace palpate {
namespace {

using test::read_file;
using test::Workspace;
using test::write_file;
using testing::HasSubstr;

/// A session below a folder that holds a recording with its scene.
class ASession : public test::SessionTest {
 protected:
  ASession() {
    test::write_plane_recording(workspace_ / "in", 12);
    begin(workspace_ / "in");
  }

  void open() { ASSERT_EQ(ask(ask::OpenScene{"scene.yaml"}), ""); }

  Workspace workspace_;
};

TEST_F(ASession, IsIdleUntilASceneIsOpenAndReadyThen) {
  EXPECT_EQ(session_->newest()->phase, Phase::idle);
  open();
  const SharedSnapshot now = session_->newest();
  EXPECT_EQ(now->phase, Phase::ready);
  EXPECT_EQ(now->source->size, cv::Size(320, 240));
  EXPECT_EQ(now->source->frame_count, 12);
  EXPECT_FALSE(now->source->pair.right.empty());
}

TEST_F(ASession, BuildsRunsToTheEndAndKeepsWhatTheTerminalKeeps) {
  open();
  ASSERT_EQ(ask(ask::Build{}), "");
  EXPECT_GT(session_->newest()->map->map.mesh.tetrahedra.size(), 100u);
  EXPECT_EQ(session_->newest()->stages.back().stage, "attachments");
  ASSERT_EQ(ask(ask::Start{false}), "");
  const SharedSnapshot end = wait_for([](const Snapshot& s) { return s.run && s.run->over; });
  EXPECT_EQ(end->phase, Phase::ready);
  EXPECT_EQ(end->run->end, "");
  EXPECT_EQ(end->run->rows->size(), 12u);
  for (const char* name : {"forces.csv", "overlay.mp4", "report.html", "run.yaml", "map.vtu", "preview.png"})
    EXPECT_TRUE(std::filesystem::exists(end->run->folder / name)) << name;
  const std::vector<ForceRow> rows = read_forces(end->run->folder / "forces.csv");
  ASSERT_EQ(rows.size(), 12u);
  for (size_t i = 0; i < rows.size(); ++i)
    EXPECT_NEAR(rows[i].force_magnitude_N, end->run->rows->from(i, 1).front().force_magnitude_N, 1e-6);
  const std::vector<ShapePlace> shapes = shape_places(end->run->folder / "shapes.bin");
  ASSERT_FALSE(shapes.empty());
  EXPECT_EQ(shapes.front().frame, -1);
  EXPECT_EQ(read_shape(end->run->folder / "shapes.bin", shapes.front()), shape_bytes(*end->map));
}

TEST_F(ASession, RefusesAnEditWithASentenceAndKeepsTheScene) {
  open();
  const std::string before = session_->newest()->scene_text;
  EXPECT_THAT(ask(ask::Edit{{{{"map", "thickness_mm"}, "-3"}}}), HasSubstr("map.thickness_mm is -3, expected 0 < x"));
  EXPECT_THAT(ask(ask::Edit{{{{"map", "thicknes_mm"}, "3"}}}), HasSubstr("did you mean 'thickness_mm'?"));
  EXPECT_EQ(session_->newest()->scene_text, before);
  EXPECT_EQ(session_->newest()->phase, Phase::ready);
}

TEST_F(ASession, UndoesAndRedoesAndSavesWithCommentsKept) {
  const std::string text = "# mine\n" + read_file(workspace_ / "in/scene.yaml") + "# end\n";
  write_file(workspace_ / "in/scene.yaml", text);
  open();
  ASSERT_EQ(ask(ask::Edit{{{{"map", "thickness_mm"}, "18"}}}), "");
  EXPECT_FALSE(session_->newest()->is_saved);
  EXPECT_EQ(session_->newest()->scene.scene.map.thickness_mm, 18);
  ASSERT_EQ(ask(ask::Undo{}), "");
  EXPECT_EQ(session_->newest()->scene_text, text);
  EXPECT_TRUE(session_->newest()->is_saved);
  ASSERT_EQ(ask(ask::Redo{}), "");
  ASSERT_EQ(ask(ask::Save{"mine.yaml"}), "");
  const std::string saved = read_file(workspace_ / "in/mine.yaml");
  EXPECT_THAT(saved, testing::AllOf(HasSubstr("# mine\n"), HasSubstr("thickness_mm: 18"), HasSubstr("# end\n")));
  EXPECT_EQ(read_scene_file(workspace_ / "in/mine.yaml", true).scene.map.thickness_mm, 18);
}

TEST_F(ASession, AnEditMakesTheMapStaleAndARunIsRefusedThen) {
  open();
  EXPECT_THAT(ask(ask::Start{}), HasSubstr("no map yet"));
  ASSERT_EQ(ask(ask::Build{}), "");
  ASSERT_EQ(ask(ask::Edit{{{{"tissue", "young_modulus_kPa"}, "10"}}}), "");
  EXPECT_TRUE(session_->newest()->map_is_stale);
  EXPECT_THAT(ask(ask::Start{}), HasSubstr("built again"));
  ASSERT_EQ(ask(ask::Undo{}), "");
  EXPECT_FALSE(session_->newest()->map_is_stale);
}

TEST_F(ASession, ABuildThatFailsSaysWhyAndTheSceneStays) {
  open();
  ASSERT_EQ(ask(ask::Edit{{{{"map", "frame"}, "99"}}}), "");
  EXPECT_THAT(ask(ask::Build{}), HasSubstr("map.frame is 99, but the recording has only 12 frames"));
  EXPECT_EQ(session_->newest()->phase, Phase::failed);
  ASSERT_EQ(ask(ask::Undo{}), "");
  EXPECT_EQ(session_->newest()->phase, Phase::ready);
}

TEST_F(ASession, TheMapIsBuiltAgainFromTheFrameThatARunHasComeTo) {
  open();
  ASSERT_EQ(ask(ask::Build{}), "");
  ASSERT_EQ(ask(ask::Start{true}), "");
  wait_for([](const Snapshot& s) { return s.run && s.run->shown; });
  ASSERT_EQ(ask(ask::Rest{}), "");
  const SharedSnapshot now = session_->newest();
  EXPECT_EQ(now->map_number, 2u);
  ASSERT_EQ(now->run->marks.size(), 1u);
  EXPECT_EQ(now->map->map.frame, now->run->marks.front().frame);
  const SharedSnapshot end = wait_for([](const Snapshot& s) { return s.run->over; });
  EXPECT_EQ(end->run->end, "");
  EXPECT_EQ(read_forces(end->run->folder / "forces.csv").size(), 12u);
  EXPECT_THAT(read_file(end->run->folder / "marks.csv"), HasSubstr("map built again from this frame"));
}

TEST_F(ASession, StopEndsARunAndKeepsItsRows) {
  open();
  ASSERT_EQ(ask(ask::Build{}), "");
  ASSERT_EQ(ask(ask::Start{true}), "");
  ASSERT_EQ(ask(ask::Stop{}), "");
  const SharedSnapshot end = wait_for([](const Snapshot& s) { return s.run->over; });
  EXPECT_EQ(read_forces(end->run->folder / "forces.csv").size(), end->run->rows->size());
  EXPECT_TRUE(std::filesystem::exists(end->run->folder / "report.html"));
}

TEST_F(ASession, OpensARecordingWithASceneOfItsOwn) {
  ASSERT_EQ(ask(ask::OpenRecording{"left.avi", "right.avi", "", "calibration.yaml"}), "");
  const SharedSnapshot now = session_->newest();
  EXPECT_FALSE(now->is_saved);
  EXPECT_EQ(now->scene_file.filename(), "scene-2.yaml");
  EXPECT_EQ(now->scene.scene.tissue.young_modulus_kPa, 27);
  EXPECT_EQ(now->source->frame_count, 12);
}

TEST_F(ASession, NothingOutsideOfItsFolderIsOpened) {
  write_file(workspace_ / "secret.yaml", read_file(workspace_ / "in/scene.yaml"));
  std::filesystem::create_symlink(workspace_ / "secret.yaml", workspace_ / "in/link.yaml");
  for (const char* name : {"../secret.yaml", "link.yaml", "/etc/passwd", "x/../../secret.yaml"})
    EXPECT_THAT(ask(ask::OpenScene{name}), HasSubstr("outside of the folder")) << name;
  open();
  std::filesystem::copy(workspace_ / "in/left.avi", workspace_ / "left.avi");
  EXPECT_THAT(ask(ask::Edit{{{{"recording", "left"}, "../left.avi"}}}), HasSubstr("outside of the folder"));
  for (const char* value : {"\"videotestsrc ! appsink\"", "rtsp://host/x", "0", "/dev/video0"})
    EXPECT_THAT(ask(ask::Edit{{{{"recording", "left"}, value}}}), HasSubstr("is a live source")) << value;
  EXPECT_THAT(ask(ask::OpenRecording{"a ! b", "c ! d", "", "calibration.yaml"}), HasSubstr("is a live source"));
  EXPECT_THAT(ask(ask::Save{"../x.yaml"}), HasSubstr("no name for a scene"));
  EXPECT_EQ(session_->newest()->phase, Phase::failed);
}

TEST_F(ASession, WhatTheOperatorNamesAtTheStartMayLieElsewhere) {
  std::filesystem::create_directories(workspace_ / "scenes");
  test::replace_in_file(workspace_ / "in/scene.yaml",
                        "{left: left.avi, right: right.avi, calibration: calibration.yaml}",
                        "{left: ../in/left.avi, right: ../in/right.avi, calibration: ../in/calibration.yaml}");
  std::filesystem::rename(workspace_ / "in/scene.yaml", workspace_ / "scenes/scene.yaml");
  Session session(RootFolder(workspace_ / "scenes"), {});
  session.open_trusted(workspace_ / "scenes/scene.yaml");
  EXPECT_EQ(session.newest()->phase, Phase::ready);
  std::promise<std::string> told;
  session.ask(ask::Edit{{{{"map", "thickness_mm"}, "12"}}}, [&](const std::string& s) { told.set_value(s); });
  EXPECT_EQ(told.get_future().get(), "");
}

TEST(SceneKeys, EveryKeyHasItsValuesAndItsMeaning) {
  const std::vector<KeyRow> keys = scene_keys();
  EXPECT_GT(keys.size(), 80u);
  const auto thickness =
      std::find_if(keys.begin(), keys.end(), [](const KeyRow& row) { return row.key == "map.thickness_mm"; });
  ASSERT_NE(thickness, keys.end());
  EXPECT_EQ(thickness->default_text, "25");
  EXPECT_EQ(thickness->values, "0 < x <= 500");
  EXPECT_THAT(thickness->meaning, HasSubstr("depth of the body"));
  for (const KeyRow& row : keys) EXPECT_FALSE(row.meaning.empty()) << row.key;
}

}  // namespace
}  // namespace palpate
