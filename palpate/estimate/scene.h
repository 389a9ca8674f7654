#pragma once

#include <filesystem>

#include "palpate/contact/contact_options.h"
#include "palpate/core/settings.h"
#include "palpate/estimate/force_uncertainty.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/infer/inference_parameters.h"
#include "palpate/instrument/instrument_tracker.h"
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
  UncertaintyOptions uncertainty;
  InferenceParameters tuning;
  bool has_tuning = false;  ///< stands in the file, and is written
};

/// Binds every part but `recording`, which a scene that is to be simulated does not have.
void describe(Settings& settings, Scene& scene);

/// A scene with its recording, and nothing of what only the program knows (overlay, simulate). Throws BadInput.
Scene read_scene(const std::filesystem::path& file);

}  // namespace palpate
