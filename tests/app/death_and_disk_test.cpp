#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <opencv2/videoio.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "palpate/feedback/forces_file.h"
#include "tests/app/program.h"

namespace palpate::test {
namespace {

namespace fs = std::filesystem;

int count_lines(const fs::path& file) {
  const std::string text = fs::exists(file) ? read_file(file) : "";
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

int frames_that_play(const fs::path& video) {
  cv::VideoCapture reader(video.string());
  int frames = 0;
  for (cv::Mat image; reader.read(image);) ++frames;
  return frames;
}

pid_t start_estimate(const fs::path& scene, const fs::path& folder) {
  const pid_t child = fork();
  if (child != 0) return child;
  if (nice(19) == -1) _exit(126);  // the test has to be quicker than what it kills
  const int nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  execl(PALPATE_PROGRAM, PALPATE_PROGRAM, "estimate", scene.c_str(), "-o", folder.c_str(), nullptr);
  _exit(127);
}

bool has_ended(pid_t child) {
  return waitpid(child, nullptr, WNOHANG) == child;
}

class Estimate : public ::testing::Test {
 protected:
  static constexpr int kFrames = 120;

  void SetUp() override { write_plane_recording(folder_ / "recording", kFrames); }
  fs::path scene() const { return folder_ / "recording/scene.yaml"; }
  std::string command(const fs::path& output) const {
    return "estimate " + scene().string() + " -o " + output.string();
  }

  Workspace folder_;
};

/// A disk of its own; nothing is mounted where that is not allowed.
class SmallDisk {
 public:
  SmallDisk(const fs::path& place, const std::string& options) : place_(place) {
    fs::create_directories(place);
    mounted_ = mount("tmpfs", place.c_str(), "tmpfs", 0, options.c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount2(place_.c_str(), MNT_DETACH);
  }
  bool mounted() const { return mounted_; }

  /// Fills it until so many bytes are free.
  void leave_free(std::uintmax_t bytes) const {
    const std::uintmax_t available = fs::space(place_).available;
    ASSERT_GE(available, bytes);
    write_file(place_ / "ballast", std::string(available - bytes, 'x'));
  }
  void make_read_only() const { mount("", place_.c_str(), "", MS_REMOUNT | MS_RDONLY, nullptr); }

 private:
  fs::path place_;
  bool mounted_ = false;
};

TEST_F(Estimate, KilledAtAnyMomentLeavesWholeRowsAndAVideoThatPlays) {
  for (const int rows_before : {1, 5, 17, 40, 80}) {
    const fs::path output = folder_ / ("killed_" + std::to_string(rows_before));
    const pid_t child = start_estimate(scene(), output);
    while (count_lines(output / "forces.csv") < rows_before + 1) {
      ASSERT_FALSE(has_ended(child)) << "the run ended before it was killed";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const std::vector<ForceRow> rows = read_forces(output / "forces.csv");
    ASSERT_GE(static_cast<int>(rows.size()), rows_before);
    for (size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].frame, static_cast<int>(i));
    EXPECT_EQ(read_file(output / "forces.csv").back(), '\n') << "half a row";
    EXPECT_GE(frames_that_play(output / "overlay.mp4"), static_cast<int>(rows.size())) << rows_before;
    EXPECT_TRUE(fs::exists(output / "run.yaml"));
    EXPECT_FALSE(fs::exists(output / "report.html"));
  }
}

TEST_F(Estimate, ASecondRunIntoAFolderLeavesItsOwnFilesOnly) {
  const fs::path output = folder_ / "twice";
  fs::create_directories(output);
  for (const char* stale : {"forces.csv", "forces_2.csv", "overlay.mp4", "report.html", "run.yaml", "map.vtu",
                            "surface.ply", "cloud.ply.part", "preview.png", "map.json", "shapes.bin", "notes.txt"})
    write_file(output / stale, "of an earlier run");
  ASSERT_EQ(run_palpate(command(output)).exit_code, 0);
  const std::string first = read_file(output / "forces.csv");
  ASSERT_EQ(run_palpate(command(output)).exit_code, 0);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(output)) {
    names.insert(entry.path().filename().string());
    EXPECT_EQ(read_file(entry.path()) == "of an earlier run", entry.path().filename() == "notes.txt") << entry.path();
  }
  EXPECT_EQ(names, (std::set<std::string>{"forces.csv", "overlay.mp4", "report.html", "run.yaml", "map.vtu",
                                          "surface.ply", "cloud.ply", "preview.png", "confidence.png", "map.json",
                                          "shapes.bin", "notes.txt"}));
  EXPECT_EQ(count_lines(output / "forces.csv"), kFrames + 1);
}

TEST_F(Estimate, ARunThatIsRefusedLeavesTheEarlierResultsWhole) {
  const fs::path output = folder_ / "kept";
  ASSERT_EQ(run_palpate(command(output)).exit_code, 0);
  const std::string rows = read_file(output / "forces.csv");
  replace_in_file(scene(), "thickness_mm: 15", "thickness_mm: -15");
  EXPECT_EQ(run_palpate(command(output)).exit_code, 3);
  EXPECT_EQ(read_file(output / "forces.csv"), rows);
}

TEST_F(Estimate, ADiskTooSmallForTheCloudStillTakesEveryForce) {
  const SmallDisk disk(folder_ / "disk", "size=6m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not allowed here";
  disk.leave_free(1400 << 10);
  const Outcome outcome = run_palpate(command(folder_ / "disk/results"));
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_NE(outcome.error.find("cloud.ply cannot be written"), std::string::npos) << outcome.error;
  EXPECT_NE(outcome.error.find("120 frames are kept"), std::string::npos) << outcome.error;
  EXPECT_EQ(count_lines(folder_ / "disk/results/forces.csv"), kFrames + 1);
  EXPECT_FALSE(fs::exists(folder_ / "disk/results/cloud.ply"));
  EXPECT_FALSE(fs::exists(folder_ / "disk/results/cloud.ply.part"));
}

TEST_F(Estimate, ADiskThatFillsEndsTheVideoFirstAndTheRowsLast) {
  const SmallDisk disk(folder_ / "disk", "size=6m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not allowed here";
  disk.leave_free((1 << 20) + (180 << 10));
  const Outcome outcome = run_palpate(command(folder_ / "disk/results"));
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_NE(outcome.error.find("overlay.mp4"), std::string::npos) << outcome.error;
  EXPECT_EQ(count_lines(folder_ / "disk/results/forces.csv"), kFrames + 1);
  const int pictures = frames_that_play(folder_ / "disk/results/overlay.mp4");
  EXPECT_GT(pictures, 0);
  EXPECT_LT(pictures, kFrames);
}

TEST_F(Estimate, ADiskWithoutRoomForTheRowsKeepsThoseThatItTook) {
  const SmallDisk disk(folder_ / "disk", "size=6m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not allowed here";
  disk.leave_free(24 << 10);
  const Outcome outcome = run_palpate(command(folder_ / "disk/results"));
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_NE(outcome.error.find("forces.csv"), std::string::npos) << outcome.error;
  const std::string text = read_file(folder_ / "disk/results/forces.csv");
  EXPECT_EQ(text.back(), '\n');
  EXPECT_GT(read_forces(folder_ / "disk/results/forces.csv").size(), 10u);
  EXPECT_LT(count_lines(folder_ / "disk/results/forces.csv"), kFrames + 1);
}

TEST_F(Estimate, AReadOnlyFolderIsRefusedBeforeTheWorkBegins) {
  const SmallDisk disk(folder_ / "disk", "size=6m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not allowed here";
  disk.make_read_only();
  const Outcome outcome = run_palpate(command(folder_ / "disk/results"));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.error.find("Read-only file system"), std::string::npos) << outcome.error;
}

TEST_F(Estimate, AVideoThatShrinksWhileItIsReadEndsWithFourAndItsName) {
  const fs::path output = folder_ / "shrinks", left = folder_ / "recording/left.avi";
  const pid_t child = start_estimate(scene(), output);
  while (count_lines(output / "forces.csv") < 6) {
    ASSERT_FALSE(has_ended(child)) << "the run ended before the file shrank";
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  fs::resize_file(left, fs::file_size(left) / 2);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 4);
  EXPECT_GE(count_lines(output / "forces.csv"), 6);
  EXPECT_LT(count_lines(output / "forces.csv"), kFrames + 1);
  EXPECT_TRUE(fs::exists(output / "report.html"));
}

}  // namespace
}  // namespace palpate::test
