#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace palpate {

/// One answer of the force loop. Left camera frame.
struct ForceSample {
  uint64_t sequence = 0;
  int64_t wall_ns = 0;  ///< since 1970
  bool valid = false;   ///< false: the force is a ramp to zero, or zero
  bool in_contact = false;
  bool limited = false;
  bool damped = false;
  bool frames_late = false;        ///< the watchdog has struck
  std::array<float, 3> force_N{};  ///< of the instrument on the tissue
  std::array<float, 3> tip_mm{};   ///< the tip that was answered to
  float stiffness_N_per_mm = 0;    ///< greatest of the contact
  int32_t frame = -1;              ///< of the recording, whose spring answered
  uint32_t frame_age_us = 0;       ///< since that frame's pictures were there
};

/// What UDP carries: docs/streams.md. Little endian, closed by a CRC-32.
using ForceRecord = std::array<uint8_t, 64>;

ForceRecord to_record(const ForceSample& sample);
/// Nothing where the bytes are no record.
std::optional<ForceSample> from_record(std::span<const uint8_t> bytes);

}  // namespace palpate
