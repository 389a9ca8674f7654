#include "palpate/stream/stream_hub.h"

#include <fmt/format.h>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/stream/contact_spring.h"
#include "palpate/stream/kinematic_track.h"
#include "palpate/stream/ros2_publisher.h"

namespace palpate {

// The last of these goes first: who calls others goes before them.
struct StreamHub::State {
  StreamScene scene;
  std::unique_ptr<ForceLoop> force_loop;
  std::unique_ptr<KinematicTrack> track;
  std::unique_ptr<IgtlServer> igtl;
  std::unique_ptr<Ros2Publisher> ros2;
  int instruments = 1;
};

StreamHub::StreamHub(const StreamOptions& options, const StreamScene& scene, const InstrumentOptions& instrument)
    : state_(std::make_unique<State>()) {
  if (options.any() && scene.tissue.modulus_unknown)
    throw BadInput("streams send forces in N, expected a number for tissue.young_modulus_kPa");
  State& s = *state_;
  s.scene = scene;
  if (options.has_force_loop) s.force_loop = std::make_unique<ForceLoop>(options.force_loop, scene.frame_s);
  if (instrument.has_live_track()) {
    s.track = std::make_unique<KinematicTrack>(instrument.track.string(), instrument.camera_from_robot);
    if (s.force_loop) s.track->pass_on([loop = s.force_loop.get()](const KinematicTip& tip) { loop->use(tip); });
  }
  if (s.track && s.track->comes_from_a_client() && !options.has_openigtlink)
    throw BadInput(fmt::format("instrument.track is {}, which a client sends, expected streams.openigtlink beside it",
                               instrument.track.string()));
  if (options.has_openigtlink) {
    std::function<ForceSample()> force;
    std::function<void(const IgtlReceived&)> on_transform;
    if (s.force_loop) force = [loop = s.force_loop.get()] { return loop->newest(); };
    if (s.track && s.track->comes_from_a_client())
      on_transform = [track = s.track.get()](const IgtlReceived& message) { track->take(message); };
    s.igtl = std::make_unique<IgtlServer>(options.openigtlink, scene, std::move(force), std::move(on_transform));
  }
  if (options.has_ros2) s.ros2 = std::make_unique<Ros2Publisher>(options.ros2);
  if (s.track) s.track->start();
}

StreamHub::~StreamHub() = default;
StreamHub::StreamHub(StreamHub&&) noexcept = default;

std::function<std::optional<TipTrack::Row>()> StreamHub::live_tip() const {
  if (!state_->track) return {};
  return [track = state_->track.get()] { return track->at_frame(); };
}

void StreamHub::publish(const ForceEstimate& estimate, const cv::Mat& overlay, int64_t decoded_ns) {
  State& s = *state_;
  if (s.force_loop) {
    ContactSpring spring = contact_spring(estimate, s.scene.friction, decoded_ns);
    if (s.track && s.track->last_at_frame().known) {
      const auto& tip = s.track->last_at_frame().tip_mm;
      spring.has_kinematic_tip = true;
      spring.kinematic_tip_mm = {tip[0], tip[1], tip[2]};
    }
    s.force_loop->use(spring);
  }
  if (!s.igtl && !s.ros2) return;
  auto frame = std::make_shared<StreamFrame>();
  frame->estimate = estimate;
  if (!estimate.further.empty() && has_tip(estimate.further.front())) s.instruments = 2;
  frame->instruments = estimate.further.empty() ? 1 : s.instruments;
  frame->overlay = overlay;
  frame->decoded_ns = decoded_ns;
  frame->wall_ns = wall_ns() - (steady_ns() - decoded_ns);
  if (s.igtl) s.igtl->publish(frame);
  if (s.ros2) s.ros2->publish(frame);
}

std::vector<std::string> StreamHub::notes() const {
  std::vector<std::string> notes;
  if (state_->force_loop && !state_->force_loop->note().empty()) notes.push_back(state_->force_loop->note());
  return notes;
}

std::vector<std::string> StreamHub::summary() const {
  std::vector<std::string> lines;
  if (state_->force_loop) {
    const ForceLoopTiming timing = state_->force_loop->timing();
    lines.push_back(
        fmt::format("force loop: {} answers, {} missed, late by {:.3f} ms median, {:.3f} ms for 99 %, {:.3f} "
                    "ms for 99.9 %",
                    timing.answers, timing.missed, timing.late_p50_ms, timing.late_p99_ms, timing.late_p999_ms));
  }
  if (state_->igtl) {
    const IgtlServerCounts counts = state_->igtl->counts();
    lines.push_back(
        fmt::format("OpenIGTLink: {} messages, {:.1f} MB, {} clients dropped, {:.1f} ms median from frame to "
                    "wire",
                    counts.messages, static_cast<double>(counts.bytes) * 1e-6, counts.dropped, counts.latency_p50_ms));
  }
  if (state_->ros2) lines.push_back(fmt::format("ROS 2: {} messages", state_->ros2->messages()));
  return lines;
}

const ForceLoop* StreamHub::force_loop() const {
  return state_->force_loop.get();
}

const IgtlServer* StreamHub::openigtlink() const {
  return state_->igtl.get();
}

}  // namespace palpate
