#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <future>

#include "palpate/session/session.h"
#include "tests/session/session_test_base.h"
#include "tests/support/live_cameras.h"
#include "tests/support/plane_recording.h"

namespace palpate {
namespace {

using test::painted_number;
using test::read_file;
using testing::HasSubstr;

/// A session that may open live sources, and the plane, sent over loopback by another program.
class ALiveSession : public test::SessionTest {
 protected:
  void SetUp() override {
    if (!test::has_gstreamer()) GTEST_SKIP() << "gst-launch-1.0 or its plugins are missing";
    test::write_plane_recording(workspace_ / "in", 1);
    std::vector<cv::Mat> left, right;
    for (int i = 0; i < 100; ++i) {
      const test::PlanePair pair = test::plane_pair(i);
      left.push_back(pair.left);
      right.push_back(pair.right);
    }
    std::filesystem::create_directories(workspace_ / "cameras");
    test::write_numbered(workspace_ / "cameras", "left", left);
    test::write_numbered(workspace_ / "cameras", "right", right);
    send();
    begin(workspace_ / "in", true);
  }

  void send() { senders_ = std::make_unique<test::Senders>(workspace_ / "cameras", cameras_); }

  void open() {
    ASSERT_EQ(ask(ask::OpenRecording{test::receiver(cameras_[0].port), test::receiver(cameras_[1].port), "",
                                     "calibration.yaml"}),
              "");
    ASSERT_EQ(ask(ask::Edit{{{{"map"},
                              "{elements: 400, thickness_mm: 15,  # thin\n"
                              "organ_region_px: [[40, 30], [300, 30], [300, 210], [40, 210]]}"}}}),
              "");
  }

  test::Workspace workspace_;
  std::vector<test::Sender> cameras_{{"left", test::free_port(), 0}, {"right", test::free_port(), 0}};
  std::unique_ptr<test::Senders> senders_;
};

TEST_F(ALiveSession, ShowsItsSourceAsItIsAndSaysWhereItIsSilent) {
  open();
  EXPECT_EQ(session_->newest()->scene_file.parent_path(), workspace_ / "in");
  const uint64_t first = session_->newest()->source->number;
  const SharedSnapshot later = wait_for([&](const Snapshot& s) { return s.source->number > first + 1; });
  EXPECT_TRUE(later->source->timing.is_live);
  EXPECT_EQ(painted_number(later->source->frame.left), painted_number(later->source->frame.right));
  senders_.reset();
  wait_for([](const Snapshot& s) { return s.source->is_silent; });
  send();
  wait_for([](const Snapshot& s) { return !s.source->is_silent; });
}

TEST_F(ALiveSession, RunsUntilItIsStoppedAndTheSourceGoesOn) {
  open();
  ASSERT_EQ(ask(ask::Build{}), "");
  EXPECT_EQ(session_->newest()->map->map.frame, -1);
  ASSERT_EQ(ask(ask::Start{}), "");
  wait_for([](const Snapshot& s) { return s.run && s.run->rows->size() >= 8; });
  ASSERT_EQ(ask(ask::Stop{}), "");
  const SharedSnapshot end = wait_for([](const Snapshot& s) { return s.run->over; });
  EXPECT_EQ(end->run->end, "");
  const std::vector<ForceRow> rows = read_forces(end->run->folder / "forces.csv");
  EXPECT_EQ(rows.size(), end->run->rows->size());
  EXPECT_EQ(rows.front().frame, 0);
  EXPECT_THAT(read_file(end->run->folder / "run.yaml"),
              HasSubstr("dropped_frames: " + std::to_string(end->run->dropped)));
  wait_for([&](const Snapshot& s) { return s.source->number > end->source->number; });
}

TEST_F(ALiveSession, ARecordedVideoOpensAgainWithTheSameMeaning) {
  open();
  EXPECT_EQ(ask(ask::Record{false}), "");
  ASSERT_EQ(ask(ask::Build{}), "");
  const SharedSnapshot built = session_->newest();
  ASSERT_EQ(ask(ask::Record{true}), "");
  EXPECT_THAT(ask(ask::Record{true}), HasSubstr("already"));
  EXPECT_THAT(ask(ask::Edit{{{{"recording", "fps"}, "24"}}}), HasSubstr("is being recorded"));
  wait_for([](const Snapshot& s) { return s.kept && s.kept->frames >= 12; });
  ASSERT_EQ(ask(ask::Record{false}), "");
  const KeptView kept = *session_->newest()->kept;
  EXPECT_TRUE(kept.over);
  EXPECT_EQ(kept.end, "");
  EXPECT_EQ(kept.left_out, 0);

  const SceneFile scene = read_scene_file(kept.folder / "scene.yaml", true);
  EXPECT_THAT(read_file(kept.folder / "scene.yaml"), HasSubstr("thickness_mm: 15"));
  EXPECT_EQ(scene.scene.map.organ_region_px, built->scene.scene.map.organ_region_px);
  EXPECT_EQ(scene.scene.tissue.young_modulus_kPa, built->scene.scene.tissue.young_modulus_kPa);
  Recording recording(scene.scene.recording);
  ASSERT_EQ(recording.frame_count(), kept.frames);
  EXPECT_EQ(recording.timing().left_without_right, 0);
  const StereoFrame first = *recording.next();
  EXPECT_EQ(painted_number(first.left), painted_number(built->map->frame.left));
  const StereoFrame second = *recording.next();
  EXPECT_NEAR(second.time_s, 0.04, 1e-3);
  while (const std::optional<StereoFrame> frame = recording.next()) {
    const int number = painted_number(frame->left);
    EXPECT_EQ(number, painted_number(frame->right));
    EXPECT_NEAR(frame->time_s - second.time_s, 0.04 * ((number - painted_number(second.left) + 100) % 100), 1e-3);
  }
  // As good as the same map.
  const BuiltMap again = build_map(scene, *open_recording(scene), {});
  EXPECT_EQ(again.map.mesh.tetrahedra.size() > 100, true);
  EXPECT_NEAR(again.map.report.coverage, built->map->map.report.coverage, 0.05);
  ASSERT_EQ(ask(ask::OpenScene{"recordings/" + kept.folder.filename().string() + "/scene.yaml"}), "");
  EXPECT_EQ(session_->newest()->source->frame_count, kept.frames);
}

TEST(KeptScene, NamesItsOwnVideoAndFindsTheFilesOfTheScene) {
  const test::Workspace workspace;
  std::filesystem::create_directories(workspace / "in");
  test::write_file(workspace / "in/organ.msh", "");
  const std::string text =
      "# mine\nrecording:\n  left: a ! b\n  right: c ! d\n  swap: true\n  calibration: x.yaml\n"
      "map: {frame: 7, frames: [2, 7], volume: organ.msh, thickness_mm: 9}  # thin\n";
  const std::string kept = kept_scene_text(text, workspace / "in", workspace / "in/recordings/a", true);
  EXPECT_EQ(kept,
            "# mine\nrecording: {left: left.mp4, right: right.mp4, calibration: calibration.yaml}\n"
            "map: {frame: 0, volume: \"../../organ.msh\", thickness_mm: 9}  # thin\n");
}

}  // namespace
}  // namespace palpate
