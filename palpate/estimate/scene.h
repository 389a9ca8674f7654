#pragma once

#include <filesystem>

#include "palpate/contact/contact_options.h"
#include "palpate/core/settings.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/instrument/tip_tracker.h"
#include "palpate/stereo/recording.h"

namespace palpate {

/// Everything that a run is told: scene.yaml.
struct Scene {
  RecordingOptions recording;
  MapOptions map;
  TissueOptions tissue;
  AttachmentOptions attachments;
  InstrumentOptions instrument;
  ContactOptions contact;
};

/// Binds every part of the scene file. `with_recording` is false for scenes that are to be simulated.
void describe(Settings& settings, Scene& scene, bool with_recording = true);

}  // namespace palpate
