#include "palpate/stream/kinematic_track.h"

#include "palpate/core/clock.h"
#include "palpate/stream/hand_over.h"
#include "palpate/stream/track_source.h"

namespace palpate {

struct KinematicTrack::State {
  TrackSource source;
  CameraFromRobot camera_from_robot;
  std::function<void(const KinematicTip&)> to;
  Broadcast<KinematicTip> newest;
  KinematicTip at_frame;
  std::unique_ptr<TrackReceiver> receiver;
};

KinematicTrack::KinematicTrack(const std::string& track, const CameraFromRobot& camera_from_robot)
    : state_(std::make_unique<State>()) {
  state_->source = parse_track_source(track);
  state_->camera_from_robot = camera_from_robot;
}

KinematicTrack::~KinematicTrack() = default;

void KinematicTrack::pass_on(std::function<void(const KinematicTip&)> to) {
  state_->to = std::move(to);
}

bool KinematicTrack::comes_from_a_client() const {
  return !state_->source.server;
}

void KinematicTrack::start() {
  if (state_->source.server)
    state_->receiver =
        std::make_unique<TrackReceiver>(*state_->source.server, [this](const IgtlReceived& message) { take(message); });
}

void KinematicTrack::take(const IgtlReceived& message) {
  if (message.device != state_->source.device) return;
  const Vec3 tip_mm = state_->camera_from_robot(message.translation_mm);
  const KinematicTip tip{true, steady_ns(), {tip_mm.x(), tip_mm.y(), tip_mm.z()}};
  state_->newest.write(tip);
  if (state_->to) state_->to(tip);
}

std::optional<TipTrack::Row> KinematicTrack::at_frame() {
  KinematicTip& tip = state_->at_frame = state_->newest.read();
  if (!tip.known || steady_ns() - tip.arrived_ns > kTipLasts_ns) {
    tip.known = false;
    return std::nullopt;
  }
  TipTrack::Row row;
  row.time_s = 1e-9 * static_cast<double>(tip.arrived_ns);
  row.tip_mm = {tip.tip_mm[0], tip.tip_mm[1], tip.tip_mm[2]};
  return row;
}

const KinematicTip& KinematicTrack::last_at_frame() const {
  return state_->at_frame;
}

}  // namespace palpate
