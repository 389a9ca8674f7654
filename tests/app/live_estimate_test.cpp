#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include "palpate/core/source_kind.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/session/scene_text.h"
#include "tests/app/program.h"
#include "tests/support/live_cameras.h"

namespace palpate::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// The plane, sent over loopback by another program.
class LiveEstimate : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_gstreamer()) GTEST_SKIP() << "gst-launch-1.0 or its plugins are missing";
    write_plane_recording(folder_ / "in", 1);
    std::vector<cv::Mat> left, right;
    for (int i = 0; i < 50; ++i) {
      const PlanePair pair = plane_pair(i);
      left.push_back(pair.left);
      right.push_back(pair.right);
    }
    write_numbered(folder_ / "in", "left", left);
    write_numbered(folder_ / "in", "right", right);
    replace_in_file(folder_ / "in/scene.yaml", "left: left.avi, right: right.avi,",
                    "left: " + receiver(cameras_[0].port) + ", right: " + receiver(cameras_[1].port) + ",");
    send();
  }
  void TearDown() override {
    if (child_ > 0) kill(child_, SIGKILL);
    if (child_ > 0) waitpid(child_, nullptr, 0);
  }

  void send() { senders_ = std::make_unique<Senders>(folder_ / "in", cameras_); }

  void start() {
    const std::string scene = folder_ / "in/scene.yaml", out = folder_ / "out", log = folder_ / "log.txt";
    child_ = fork();
    if (child_ != 0) return;
    const int file = open(log.c_str(), O_WRONLY | O_CREAT, 0644);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execl(PALPATE_PROGRAM, PALPATE_PROGRAM, "estimate", scene.c_str(), "-o", out.c_str(), nullptr);
    _exit(127);
  }

  /// Waits for a row of forces.csv, of all from number `first` on, of which this holds; its number.
  template <class Condition>
  size_t wait_for_row(size_t first, const Condition& holds) {
    while (true) {
      if (waitpid(child_, nullptr, WNOHANG) != 0) {
        child_ = -1;
        throw std::runtime_error("palpate ended: " + read_file(folder_ / "log.txt"));
      }
      std::istringstream lines(read_file(folder_ / "out/forces.csv"));
      size_t row = 0;
      for (std::string line; std::getline(lines, line); ++row)
        if (row > first && holds(line)) return row;
      usleep(50'000);
    }
  }

  static bool is_whole(const std::string& row) { return std::count(row.begin(), row.end(), ',') > 20; }
  static bool is_lost(const std::string& row) { return row.find("source_lost") != std::string::npos; }

  int interrupt() {
    kill(child_, SIGINT);
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  Workspace folder_;
  std::vector<Sender> cameras_{{"left", free_port(), 0}, {"right", free_port(), 0}};
  std::unique_ptr<Senders> senders_;
  pid_t child_ = -1;
};

TEST_F(LiveEstimate, EndsWithCtrlCAndKeepsWhatIsDone) {
  start();
  wait_for_row(10, is_whole);
  EXPECT_EQ(interrupt(), 0);
  const std::vector<ForceRow> rows = read_forces(folder_ / "out/forces.csv");
  ASSERT_GE(rows.size(), 10u);
  EXPECT_EQ(rows.front().frame, 0);
  EXPECT_EQ(rows.front().time_s, 0);
  for (size_t i = 1; i < rows.size(); ++i) EXPECT_GT(rows[i].time_s, rows[i - 1].time_s);
  EXPECT_THAT(read_file(folder_ / "out/run.yaml"), HasSubstr("dropped_frames: "));
  EXPECT_THAT(read_file(folder_ / "log.txt"), AllOf(HasSubstr("live, 25.00 frames/s"), HasSubstr("dropped ")));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/report.html"));
}

TEST_F(LiveEstimate, GoesOnAfterItsSourceWasAway) {
  start();
  wait_for_row(3, is_whole);
  senders_.reset();
  const size_t away = wait_for_row(3, is_lost);
  send();
  wait_for_row(away, [](const std::string& row) { return is_whole(row) && !is_lost(row); });
  EXPECT_EQ(interrupt(), 0);
  for (const ForceRow& row : read_forces(folder_ / "out/forces.csv"))
    if (row.warnings.find("source_lost") != std::string::npos) {
      EXPECT_EQ(row.status, "tool_lost");
    }
}

TEST_F(LiveEstimate, CheckSaysWhatTheLiveSourceShows) {
  const Outcome outcome = run_palpate("check " + (folder_ / "in/scene.yaml").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_THAT(outcome.error, HasSubstr("recording   live, 25.00 frames/s"));
  EXPECT_THAT(outcome.output, HasSubstr("fine"));
}

TEST(LivePage, EverySceneOnItIsOne) {
  const std::string page = read_file(std::filesystem::path(PALPATE_SOURCE_DIR) / "docs/console.md");
  const std::string mark = "```yaml\n";
  int scenes = 0;
  for (size_t at = page.find(mark); at != std::string::npos; at = page.find(mark, at)) {
    at += mark.size();
    const std::string text = page.substr(at, page.find("```", at) - at);
    const SceneFile scene = read_scene_text(
        text + "tissue: {preset: liver}\nattachments: [{underside: {depth_mm: 3}}]\n", "/tmp/scene.yaml");
    const RecordingOptions& recording = scene.scene.recording;
    for (const auto& source : {recording.left, recording.right, recording.stereo})
      if (!source.empty()) {
        EXPECT_NE(kind_of_source(source.string()), SourceKind::file) << source;
      }
    ++scenes;
  }
  EXPECT_EQ(scenes, 4);
}

}  // namespace
}  // namespace palpate::test
