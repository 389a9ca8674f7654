#include "app/track_check.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/progress.h"
#include "app/runtime.h"
#include "palpate/core/errors.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/stereo/recording.h"

namespace palpate::app {

namespace {

/// Tips of one instrument, and the number of the frame that each was seen in.
struct SeenTips {
  std::vector<SeenTip> tips;
  std::vector<int> frames;
};
using TipsOfAll = std::array<SeenTips, kMaxInstruments>;

TipsOfAll tips_in_video(const Scene& scene, const BuiltMap& built, bool quiet) {
  InstrumentOptions from_images = scene.instrument;
  from_images.track.clear();
  from_images.track_2.clear();
  const Rectification& rectification = built.rectification;
  InstrumentTracker tracker(from_images, rectification, rectify(rectification, built.frame), built.map.organ_mask);
  TipsOfAll seen;
  Recording recording(scene.recording);
  Progress progress("track", quiet);
  while (auto frame = recording.next()) {
    if (frame->left.empty() || frame->right.empty()) continue;
    const InstrumentObservations observed = tracker.update(rectify(rectification, *frame));
    for (size_t i = 0; i < kMaxInstruments; ++i) {
      if (!observed.tips[i].visible) continue;
      seen[i].tips.push_back({frame->time_s, observed.tips[i].tip_mm});
      seen[i].frames.push_back(frame->index);
    }
    progress.show(frame->index + 1, recording.frame_count(), "");
    if (interrupted()) throw Unfinished(fmt::format("interrupted after frame {}", frame->index));
  }
  return seen;
}

/// With the axes and the clock that the scene states.
void compare_as_stated(const SeenTips& seen, const TipTrack& track, const InstrumentOptions& options,
                       TrackCheck& check) {
  double squared = 0;
  int frames = 0;
  for (size_t i = 0; i < seen.tips.size(); ++i) {
    const SeenTip& tip = seen.tips[i];
    const auto row = row_of_frame(track, seen.frames[i], tip.time_s, options.time_offset_s);
    if (!row) continue;
    squared += (options.camera_from_robot(row->tip_mm) - tip.tip_mm).squaredNorm();
    ++frames;
  }
  check.stated_frames = frames;
  check.stated_rms_mm = frames > 0 ? std::sqrt(squared / frames) : 0;
}

std::string yaml_of(const Vec3& v, const char* format) {
  return fmt::format(fmt::runtime(fmt::format("[{0}, {0}, {0}]", format)), v.x(), v.y(), v.z());
}

}  // namespace

TrackCheck check_track(const SceneFile& scene_file, const BuiltMap& built, bool quiet) {
  const InstrumentOptions& options = scene_file.scene.instrument;
  const TipTrack track = read_tip_track(options.track);
  const TipsOfAll seen = tips_in_video(scene_file.scene, built, quiet);
  TrackCheck check;
  // The track may be that of either instrument in view.
  for (const SeenTips& of_one : seen) {
    if (of_one.tips.empty() && &of_one != &seen.front()) continue;
    try {
      const HandEye found = estimate_hand_eye(of_one.tips, track);
      if (check.found && check.found->rms_mm <= found.rms_mm) continue;
      check.found = found;
      compare_as_stated(of_one, track, options, check);
    } catch (const BadInput& reason) {
      if (check.why_not.empty()) check.why_not = reason.what();
    }
  }
  return check;
}

std::string to_text(const TrackCheck& check) {
  if (!check.found)
    return fmt::format("track: its axes and clock cannot be checked by the video: {}.\n", check.why_not);
  const HandEye& found = *check.found;
  const Mat3& R = found.camera_from_robot.rotation;
  std::string text;
  if (check.stated_frames > 0)
    text += fmt::format("track: {:.2f} mm RMS from the tip in the video as the scene states it, {} frames.\n",
                        check.stated_rms_mm, check.stated_frames);
  text += fmt::format(
      "track: {:.2f} mm RMS, {} frames (rotation known to {:.1f} degrees) with\n"
      "  camera_from_robot:\n    rotation: [{}, {}, {}]\n    translation_mm: {}\n  time_offset_s: {:.3f}\n",
      found.rms_mm, found.frames, found.deviation_deg, yaml_of(R.row(0), "{:.5f}"), yaml_of(R.row(1), "{:.5f}"),
      yaml_of(R.row(2), "{:.5f}"), yaml_of(found.camera_from_robot.translation_mm, "{:.2f}"), found.time_offset_s);
  return text;
}

nlohmann::ordered_json to_json(const TrackCheck& check) {
  nlohmann::ordered_json json;
  json["stated_frames"] = check.stated_frames;
  json["stated_rms_mm"] = check.stated_rms_mm;
  if (!check.found) {
    json["why_not"] = check.why_not;
    return json;
  }
  const HandEye& found = *check.found;
  const Mat3& R = found.camera_from_robot.rotation;
  const Vec3& t = found.camera_from_robot.translation_mm;
  json["camera_from_robot"]["rotation"] = {
      {R(0, 0), R(0, 1), R(0, 2)}, {R(1, 0), R(1, 1), R(1, 2)}, {R(2, 0), R(2, 1), R(2, 2)}};
  json["camera_from_robot"]["translation_mm"] = {t.x(), t.y(), t.z()};
  json["time_offset_s"] = found.time_offset_s;
  json["frames"] = found.frames;
  json["rms_mm"] = found.rms_mm;
  json["rotation_deviation_deg"] = found.deviation_deg;
  return json;
}

}  // namespace palpate::app
