#include "palpate/session/scene_file.h"

#include <fmt/format.h>

#include "palpate/core/errors.h"

namespace palpate {

void describe(Settings& settings, SceneFile& scene_file) {
  settings.group(
      "recording", "the two videos and their calibration",
      [&scene_file](Settings& group) { palpate::describe(group, scene_file.scene.recording); },
      &scene_file.has_recording);
  palpate::describe(settings, scene_file.scene);
  settings.group("overlay", "how the stress is drawn",
                 [&scene_file](Settings& group) { palpate::describe(group, scene_file.overlay); });
  settings.group(
      "simulate", "what DejaVu makes (palpate simulate)",
      [&scene_file](Settings& group) { palpate::describe(group, scene_file.simulate); }, &scene_file.has_simulate);
  settings.group(
      "streams", "what is sent live (docs/streams.md)",
      [&scene_file](Settings& group) { palpate::describe(group, scene_file.streams); }, &scene_file.has_streams);
  settings.group(
      "run", "what a run found, written into run.yaml; without effect when read",
      [&scene_file](Settings& group) {
        group.matrix3("rectified_from_left", scene_file.rectified_from_left,
                      "axes of the rectified pair in the left camera frame, row by row");
        group.vector3("peak_force_per_modulus_N_per_kPa", scene_file.peak_force_per_modulus_N_per_kPa, {0, 1e9},
                      "greatest force over E, and its 95 % band: [value, low, high]");
        group.integer("dropped_frames", scene_file.dropped_frames, {0, 2e9},
                      "frames of a live source in whose place a newer one was looked at");
      },
      &scene_file.has_run);
}

SceneFile read_scene_file(const std::filesystem::path& file, bool needs_recording) {
  SceneFile scene_file;
  scene_file.file = file;
  Settings settings;
  describe(settings, scene_file);
  read_settings_file(file, settings);
  if (needs_recording && !scene_file.has_recording)
    throw BadInput(fmt::format("{}: recording is missing (the two videos and their calibration)", file.string()));
  return scene_file;
}

std::string write_scene_file(SceneFile scene_file) {
  Settings settings;
  describe(settings, scene_file);
  return write_settings(settings);
}

std::string document_scene_file() {
  SceneFile scene_file;
  Settings settings;
  describe(settings, scene_file);
  return document_settings(settings);
}

}  // namespace palpate
