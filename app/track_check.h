#pragma once

#include <optional>
#include <string>

#include "app/run.h"
#include "palpate/instrument/hand_eye.h"

namespace palpate::app {

/// What the video says about a scene's tip track.
struct TrackCheck {
  std::optional<HandEye> found;  ///< axes and clock by which both agree best
  std::string why_not;           ///< a sentence, where nothing is found
  int stated_frames = 0;         ///< in which both have a tip, with the axes and the clock that the scene states
  double stated_rms_mm = 0;      ///< between them there
};

/// Follows the instruments through the whole recording and compares with `instrument.track`.
TrackCheck check_track(const SceneFile& scene_file, const BuiltMap& built, bool quiet);

/// Lines for people: the agreement, and the keys to paste.
std::string to_text(const TrackCheck& check);
nlohmann::ordered_json to_json(const TrackCheck& check);

}  // namespace palpate::app
