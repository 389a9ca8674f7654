#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "palpate/feedback/forces_file.h"
#include "palpate/stream/address.h"
#include "tests/app/program.h"
#include "tests/support/live_cameras.h"

namespace palpate::test {
namespace {

constexpr const char* kScene = R"(map: {elements: 1000}
tissue: {law: neo-hookean, young_modulus_kPa: 400, poisson_ratio: 0.35}
attachments: [{underside: {depth_mm: 6}}]
contact: {footprint_radius_mm: 3.5, grip: grasp}
simulate:
  body: {shape: pear, size_mm: [62, 48, 44], center_mm: [0, 2, 112], rotation_deg: [-12, 8, -10], elements: 1500}
  camera: {width: 480, height: 270, focal_px: 350, fps: 12.5}
  instrument: {enters_from: [130, 25, 20]}
  gesture: [{approach_s: 0.4, at_px: [280, 135]}, {grasp: true}, {move_mm: [3, 1, 0], during_s: 0.6}, {hold_s: 1},
            {move_mm: [0.5, 0, 0], during_s: 0.6}, {hold_s: 0.5}, {release: true, leave_s: 0.3}]
  second:
    instrument: {enters_from: [-130, 30, 20]}
    gesture: [{approach_s: 1.1, at_px: [190, 125]}, {grasp: true}, {move_mm: [2.5, -1, 0], during_s: 0.5}, {hold_s: 0.3},
              {move_mm: [-1.5, 0, 0], during_s: 0.5}, {release: true, leave_s: 0.3}]
)";

/// What a robot would write of the tip whose truth is known.
void write_track(const std::filesystem::path& truth, const std::filesystem::path& track) {
  std::string text = "frame,time_s,x_mm,y_mm,z_mm,closed\n";
  for (const ForceRow& row : read_truth(truth))
    text += std::to_string(row.frame) + "," + std::to_string(row.time_s) + "," + std::to_string(row.tip_mm.x()) + "," +
            std::to_string(row.tip_mm.y()) + "," + std::to_string(row.tip_mm.z()) + "," + (row.in_contact ? "1" : "0") +
            "\n";
  write_file(track, text);
}

/// A recording of both in `in`, with the tip of each as a robot would write it.
void simulate_both(const Workspace& workspace) {
  write_file(workspace / "two.yaml", kScene);
  const Outcome made =
      run_palpate("simulate " + (workspace / "two.yaml").string() + " -o " + (workspace / "in").string());
  ASSERT_EQ(made.exit_code, 0) << made.error;
  write_track(workspace / "in/truth.csv", workspace / "in/tip.csv");
  write_track(workspace / "in/truth_2.csv", workspace / "in/tip_2.csv");
  replace_in_file(workspace / "in/scene.yaml", "instrument:\n",
                  "instrument:\n  track: tip.csv\n  track_2: tip_2.csv\n");
}

TEST(TwoInstruments, HoldTheSameBodyAndHaveEachTheirOwnForce) {
  const Workspace workspace;
  ASSERT_NO_FATAL_FAILURE(simulate_both(workspace));
  const Outcome outcome =
      run_palpate("estimate " + (workspace / "in/scene.yaml").string() + " -o " + (workspace / "out").string() +
                  " --json --truth " + (workspace / "in/truth.csv").string());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.output);
  for (const char* name : {"comparison", "comparison_2"}) {
    const auto& figures = json[name];
    EXPECT_GT(figures["true_peak_N"].get<double>(), 3) << name;
    EXPECT_LT(figures["force_nrmse_pct"].get<double>(), 12) << name;
    EXPECT_LT(figures["direction_error_deg_median"].get<double>(), 5) << name;
    EXPECT_EQ(figures["onset_error_frames"].get<int>(), 0) << name;
    EXPECT_EQ(figures["release_error_frames"].get<int>(), 0) << name;
    EXPECT_EQ(figures["missing_frames"].get<int>(), 0) << name;
  }
  // While the first stands still, the second one's pull is felt in it.
  const std::vector<ForceRow> truth = read_truth(workspace / "in/truth.csv"),
                              found = read_forces(workspace / "out/forces.csv");
  const size_t before = 13, after = 21;
  const Vec3 true_change_N = truth[after].force_N - truth[before].force_N;
  ASSERT_EQ(truth[after].tip_mm, truth[before].tip_mm);
  EXPECT_GT(true_change_N.norm(), 0.05);
  const Vec3 change_N = found[after].force_N - found[before].force_N;
  const double fraction = change_N.dot(true_change_N) / true_change_N.squaredNorm();
  EXPECT_GT(fraction, 0.5);
  EXPECT_LT(fraction, 2) << "through a body that is known by its front and its thickness";
  // When the second lets go, the first one's force does not jump.
  for (size_t frame = 28; frame < 33; ++frame)
    EXPECT_LT((found[frame].force_N - truth[frame].force_N).norm(), 0.16 * truth[frame].force_N.norm()) << frame;
}

using Json = nlohmann::json;

/// Reads an OpenIGTLink server (header version 1, by the published layout alone) until it goes; of each device that
/// sends STRING, what it sent.
class StringClient {
 public:
  explicit StringClient(int port) : thread_([this, port] { run(port); }) {}
  std::map<std::string, std::vector<Json>> wait() {
    thread_.join();
    return received_;
  }

 private:
  bool read(void* to, size_t size) const { return recv(socket_.get(), to, size, MSG_WAITALL) == ssize_t(size); }

  void run(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    for (int i = 0; i < 3000; ++i) {
      socket_ = Descriptor(socket(AF_INET, SOCK_STREAM, 0));
      if (connect(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) break;
      usleep(10'000);
    }
    std::array<char, 58> header;
    while (read(header.data(), header.size())) {
      uint64_t size = 0;
      for (size_t i = 42; i < 50; ++i) size = size << 8 | static_cast<uint8_t>(header[i]);
      std::string body(size, '\0');
      if (!read(body.data(), body.size())) return;
      if (std::string(&header[2]) == "STRING") received_[&header[14]].push_back(Json::parse(body.substr(4)));
    }
  }

  Descriptor socket_;
  std::map<std::string, std::vector<Json>> received_;
  std::thread thread_;
};

/// What was sent is what is written: as many digits as the file has.
void expect_same(const std::vector<Json>& sent, const std::vector<ForceRow>& written) {
  EXPECT_GE(sent.size(), written.size() / 4) << "newest wins, but most are seen";
  int with_force = 0;
  for (const Json& state : sent) {
    const int frame = state["frame"].get<int>();
    const auto found =
        std::find_if(written.begin(), written.end(), [frame](const ForceRow& row) { return row.frame == frame; });
    ASSERT_NE(found, written.end()) << frame;
    const ForceRow& row = *found;
    EXPECT_EQ(state["status"], row.status);
    EXPECT_EQ(state["valid"], state.contains("force_N"));
    if (!state.contains("force_N")) continue;
    const auto force_N = state["force_N"].get<std::array<double, 3>>();
    EXPECT_LT((Vec3(force_N[0], force_N[1], force_N[2]) - row.force_N).norm(), 1e-3) << row.frame;
    if (row.force_magnitude_N > 0.1) ++with_force;
  }
  EXPECT_GE(with_force, 3);
}

TEST(TwoInstruments, AreStreamedAsTheyAreWritten) {
  const Workspace workspace;
  ASSERT_NO_FATAL_FAILURE(simulate_both(workspace));
  const int port = free_port();
  write_file(workspace / "in/scene.yaml", read_file(workspace / "in/scene.yaml") +
                                              "streams:\n  openigtlink: {port: " + std::to_string(port) + "}\n");
  StringClient client(port);
  const Outcome outcome = run_palpate("estimate " + (workspace / "in/scene.yaml").string() + " -o " +
                                      (workspace / "out").string() + " --realtime");
  const auto sent = client.wait();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  ASSERT_TRUE(sent.contains("PalpateState") && sent.contains("PalpateState2"));
  const auto forces = read_forces(workspace / "out/forces.csv"), forces_2 = read_forces(workspace / "out/forces_2.csv");
  EXPECT_EQ(forces.size(), forces_2.size()) << "frames that are passed over have rows of both";
  expect_same(sent.at("PalpateState"), forces);
  expect_same(sent.at("PalpateState2"), forces_2);
  EXPECT_THAT(outcome.output + outcome.error, testing::HasSubstr("OpenIGTLink: "));
}

}  // namespace
}  // namespace palpate::test
