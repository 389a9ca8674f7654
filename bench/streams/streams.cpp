#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <fstream>

#include "app/run.h"
#include "app/runtime.h"
#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/estimate/force_estimator.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/feedback/overlay.h"
#include "palpate/stereo/recording.h"
#include "palpate/stream/address.h"
#include "palpate/stream/passive_force.h"
#include "palpate/stream/stream_hub.h"

// How late the force loop is beside the estimator at the recording's rate, what clients cost, and how well the loop
// agrees with the full solve: `bench_streams [SCENE] [--seconds N] [--fifo]`.
namespace {

using namespace palpate;
using namespace palpate::app;

constexpr int kPort = 18954, kUdpPort = 18955;
constexpr int kReading = 7, kStuck = 3;

struct Recorded {
  SceneFile scene_file;
  BuiltMap built;
  std::vector<StereoFrame> frames;
};

Recorded load(const std::filesystem::path& scene) {
  Recorded recorded{read_scene_file(scene, true), {}, {}};
  recorded.built = build_map(recorded.scene_file, true);
  Recording recording(recorded.scene_file.scene.recording);
  while (auto frame = recording.next()) recorded.frames.push_back(std::move(*frame));
  return recorded;
}

ForceEstimator estimator_of(const Recorded& r) {
  const Scene& scene = r.scene_file.scene;
  return {r.built.map, r.built.frame, r.built.rectification, scene.instrument, scene.contact, scene.tuning};
}

/// A process with clients that read all they get, and some that never read.
class Clients {
 public:
  explicit Clients(int port) : process_(fork()) {
    if (process_ != 0) return;
    std::array<pollfd, kReading> reading;
    for (int i = 0; i < kReading + kStuck; ++i) {
      const int fd = connected(port);
      if (i < kReading) reading[static_cast<size_t>(i)] = {fd, POLLIN, 0};
    }
    static std::array<char, 1 << 18> buffer;
    while (poll(reading.data(), reading.size(), -1) >= 0)
      for (const pollfd& client : reading)
        if (client.revents && recv(client.fd, buffer.data(), buffer.size(), MSG_DONTWAIT) == 0) _exit(0);
    _exit(0);
  }
  ~Clients() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }

 private:
  static int connected(int port) {
    const SocketAddress to = resolve({"127.0.0.1", port}, SOCK_STREAM, "");
    while (true) {
      const int fd = socket(AF_INET, SOCK_STREAM, 0);
      if (connect(fd, reinterpret_cast<const sockaddr*>(&to.storage), to.size) == 0) return fd;
      close(fd);
      poll(nullptr, 0, 20);
    }
  }
  pid_t process_;
};

struct RunFigures {
  std::vector<double> frame_ms;
  ForceLoopTiming loop;
  IgtlServerCounts igtl;
  double seconds = 0;
};

/// Plays the recording at its rate, again and again.
RunFigures play(const Recorded& r, const StreamOptions& options, double seconds, bool with_clients) {
  std::optional<Clients> clients;
  if (with_clients) clients.emplace(options.openigtlink.port);
  StreamHub hub(options,
                stream_scene(r.built.map, r.built.rectification.rig, r.built.fps, r.scene_file.scene.contact.friction));
  for (const std::string& note : hub.notes()) fmt::print("{}\n", note);
  RunFigures figures;
  const int64_t start_ns = steady_ns(), end_ns = start_ns + static_cast<int64_t>(1e9 * seconds);
  const auto period_ns = static_cast<int64_t>(1e9 / r.built.fps);
  while (steady_ns() < end_ns) {
    ForceEstimator estimator = estimator_of(r);
    OverlayPainter painter(r.built.rectification, r.scene_file.scene.tissue, r.scene_file.overlay);
    int64_t due_ns = steady_ns();
    for (const StereoFrame& frame : r.frames) {
      while (steady_ns() < due_ns) poll(nullptr, 0, 1);
      due_ns = std::max(due_ns + period_ns, steady_ns());
      const int64_t decoded_ns = steady_ns();
      const ForceEstimate estimate = estimator.update(frame);
      hub.publish(estimate, painter.paint(frame.left, estimate), decoded_ns);
      if (frame.index > r.scene_file.scene.map.frame)
        figures.frame_ms.push_back(1e-6 * static_cast<double>(steady_ns() - decoded_ns));
      if (steady_ns() > end_ns) break;
    }
  }
  figures.seconds = 1e-9 * static_cast<double>(steady_ns() - start_ns);
  if (hub.force_loop()) figures.loop = hub.force_loop()->timing();
  if (hub.openigtlink()) figures.igtl = hub.openigtlink()->counts();
  return figures;
}

StreamOptions force_loop_options(bool fifo) {
  StreamOptions options;
  options.has_force_loop = true;
  options.force_loop.udp = fmt::format("127.0.0.1:{}", kUdpPort);
  options.force_loop.fifo = fifo;
  return options;
}

void print_jitter(const Recorded& r, double seconds, bool fifo) {
  const RunFigures f = play(r, force_loop_options(fifo), seconds, false);
  fmt::print(
      "force loop, {}, {:.0f} s beside the estimator: {} answers, {} missed; late p50 {:.3f}, p99 {:.3f}, p99.9 "
      "{:.3f}, max {:.3f} ms; frame {:.1f} ms median\n",
      fifo ? "SCHED_FIFO" : "ordinary", f.seconds, f.loop.answers, f.loop.missed, f.loop.late_p50_ms,
      f.loop.late_p99_ms, f.loop.late_p999_ms, f.loop.late_max_ms, quantile_of(f.frame_ms, 0.5));
}

void print_clients(const Recorded& r, double seconds) {
  StreamOptions options;
  options.has_openigtlink = true;
  options.openigtlink.port = kPort;
  options.openigtlink.drop_after_s = 3600;  // the stuck ones stay
  const RunFigures alone = play(r, {}, seconds, false);
  fmt::print("no stream: frame {:.2f} ms median\n", quantile_of(alone.frame_ms, 0.5));
  for (const bool image : {false, true}) {
    options.openigtlink.overlay_hz = image ? 10 : 0;
    const RunFigures f = play(r, options, seconds, true);
    fmt::print(
        "OpenIGTLink, {} clients of which {} never read, {} IMAGE: frame {:.2f} ms median; {} clients at the end; "
        "{:.0f} messages/s, {:.2f} MB/s; frame to wire {:.1f} ms median, {:.1f} for 99 %; {:.2f} ms of CPU per "
        "client and second\n",
        kReading + kStuck, kStuck, image ? "with" : "without", quantile_of(f.frame_ms, 0.5), f.igtl.clients,
        static_cast<double>(f.igtl.messages) / f.seconds, 1e-6 * static_cast<double>(f.igtl.bytes) / f.seconds,
        f.igtl.latency_p50_ms, f.igtl.latency_p99_ms, 1000 * f.igtl.cpu_s / f.seconds / (kReading + kStuck));
  }
}

/// The true tip at a time, between the frames of truth.csv.
Vec3 true_tip_mm(const std::vector<ForceRow>& truth, double fps, double time_s) {
  const double at = std::clamp(time_s * fps, 0.0, static_cast<double>(truth.size() - 1));
  const auto before = static_cast<size_t>(at);
  const size_t after = std::min(before + 1, truth.size() - 1);
  return truth[before].tip_mm + (at - static_cast<double>(before)) * (truth[after].tip_mm - truth[before].tip_mm);
}

/// The loop in its own time, each frame's answer `late_s` after its pictures: its force at a frame's moment against the
/// full solve of that frame, which it does not have yet.
void print_agreement(const Recorded& r, const std::filesystem::path& truth_file, double late_s) {
  const std::vector<ForceRow> truth = read_truth(truth_file);
  ForceEstimator estimator = estimator_of(r);
  std::vector<ForceEstimate> estimates;
  double peak_N = 0;
  for (const StereoFrame& frame : r.frames) {
    estimates.push_back(estimator.update(frame));
    peak_N = std::max(peak_N, estimates.back().force_N.norm());
  }
  for (const bool kinematic : {true, false}) {
    PassiveForce force({1e3, 1e5});
    std::vector<double> errors;
    double squares = 0;
    size_t next = 0;
    ContactSpring spring;
    const auto steps = static_cast<int>(1000 * static_cast<double>(estimates.size() - 1) / r.built.fps);
    const auto frame_steps = static_cast<int>(1000 / r.built.fps);
    for (int ms = 0; ms <= steps; ++ms) {
      const double now_s = 0.001 * ms;
      while (next < estimates.size() && static_cast<double>(next) / r.built.fps + late_s <= now_s)
        force.use(spring = contact_spring(estimates[next++], r.scene_file.scene.contact.friction, 0));
      if (next == 0) continue;
      const double frame_s = static_cast<double>(next - 1) / r.built.fps;
      Vec3 moved_mm = (now_s - frame_s) * spring.tip_velocity_mm_per_s;
      if (kinematic) moved_mm = true_tip_mm(truth, r.built.fps, now_s) - true_tip_mm(truth, r.built.fps, frame_s);
      const SteppedForce step = force.step(spring.tip_mm + moved_mm, moved_mm, true, 0.001);
      const auto frame = static_cast<size_t>(ms / frame_steps);
      if (ms % frame_steps != 0 || estimates[frame].status != FrameStatus::ok || !spring.in_contact) continue;
      errors.push_back((step.force_N - estimates[frame].force_N).norm() / peak_N);
      squares += errors.back() * errors.back();
    }
    if (errors.empty()) continue;
    fmt::print(
        "agreement with the full solve, {} tip, {:.0f} ms late: RMS {:.1f} %, median {:.1f} %, greatest {:.1f} % of "
        "the peak of {:.2f} N ({} frames)\n",
        kinematic ? "kinematic" : "predicted", 1000 * late_s,
        100 * std::sqrt(squares / static_cast<double>(errors.size())), 100 * quantile_of(errors, 0.5),
        100 * quantile_of(errors, 1), peak_N, errors.size());
  }
}

std::string load_of_machine() {
  std::string load;
  std::getline(std::ifstream("/proc/loadavg"), load);
  return load;
}

}  // namespace

int main(int argc, char** argv) {
  choose_blas_core(argv);
  const char* data = std::getenv("PALPATE_REFERENCE_DATA");
  std::filesystem::path scene = std::filesystem::path(data ? data : "../shared/data") / "rendered_uterus/scene.yaml";
  double seconds = 60;
  bool fifo = false;
  CLI::App app("Live streams beside the estimator");
  app.add_option("scene", scene, "scene.yaml; truth.csv beside it");
  app.add_option("--seconds", seconds, "of each run");
  app.add_flag("--fifo", fifo, "the force loop also under SCHED_FIFO");
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print("load of the machine: {}\n", load_of_machine());
    const Recorded recorded = load(scene);
    for (const double late_s : {0.02, 0.035}) print_agreement(recorded, scene.parent_path() / "truth.csv", late_s);
    print_jitter(recorded, seconds, false);
    if (fifo) print_jitter(recorded, seconds, true);
    print_clients(recorded, std::min(seconds, 30.0));
    fmt::print("load of the machine: {}\n", load_of_machine());
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  }
}
