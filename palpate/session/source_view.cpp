#include "palpate/session/source_view.h"

#include "palpate/session/in_scene.h"

namespace palpate {

SourceView view_source(const SceneFile& scene, Recording& recording, int frame) {
  SourceView view;
  const StereoRig rig = in_scene(scene, "recording.calibration", [&] {
    StereoRig read = read_rig(scene.scene.recording);
    check_rig_fits(read, recording.size());
    return read;
  });
  view.size = recording.size();
  view.fps = recording.fps();
  view.frame_count = recording.frame_count();
  view.timing = recording.timing();
  view.notes = recording.notes();
  view.notes.insert(view.notes.end(), rig.notes.begin(), rig.notes.end());
  view.rectification = make_rectification(rig, recording.size());
  in_scene(scene, "recording", [&] {
    while (std::optional<StereoFrame> next = recording.next()) {
      view.frame = std::move(*next);
      const bool is_there = recording.is_live() ? !view.frame.left.empty() : view.frame.index >= frame;
      if (is_there) break;
    }
  });
  if (!view.frame.right.empty()) view.pair = rectify(view.rectification, view.frame);
  return view;
}

std::string recording_text(const SceneFile& scene) {
  RecordingOptions options = scene.scene.recording;
  Settings settings;
  describe(settings, options);
  return write_settings(settings);
}

}  // namespace palpate
