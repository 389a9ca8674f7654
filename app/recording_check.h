#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "palpate/stereo/recording.h"

namespace palpate::app {

/// Lines for people: rate, jitter, gaps, offset of the cameras; then each note.
std::string describe_input(const RecordingTiming& timing, const std::vector<std::string>& notes);

/// The same for machines, for the object `recording` of `palpate check`.
nlohmann::ordered_json timing_json(const RecordingTiming& timing, const std::vector<std::string>& notes);

}  // namespace palpate::app
