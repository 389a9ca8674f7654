#include "app/recording_check.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace palpate::app {

std::string describe_input(const RecordingTiming& timing, const std::vector<std::string>& notes) {
  std::string text = fmt::format("recording   {}\n", describe_timing(timing));
  for (const std::string& note : notes) text += fmt::format("note        {}\n", note);
  return text;
}

nlohmann::ordered_json timing_json(const RecordingTiming& timing, const std::vector<std::string>& notes) {
  return {{"rate_Hz", timing.rate_Hz},
          {"jitter_ms", timing.jitter_ms},
          {"gaps", timing.gaps},
          {"longest_gap_s", timing.longest_gap_s},
          {"right_camera_offset_ms", timing.offset_ms},
          {"frames_without_right_image", timing.left_without_right},
          {"right_images_left_out", timing.right_without_left},
          {"notes", notes}};
}

}  // namespace palpate::app
