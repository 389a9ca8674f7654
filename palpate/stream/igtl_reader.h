#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// A message that came in.
struct IgtlReceived {
  std::string type;  ///< TRANSFORM, GET_POLYDATA, STATUS, ...
  std::string device;
  Mat3 rotation = Mat3::Identity();  ///< of a TRANSFORM, as it was sent
  Vec3 translation_mm = Vec3::Zero();
};

/// Takes the bytes of an OpenIGTLink connection apart, in whatever pieces they come: header versions 1 and 2. Bodies
/// other than those of TRANSFORM are skipped by their size, however large.
class IgtlReader {
 public:
  /// Calls `on_message` for each message that is complete; a TRANSFORM whose checksum is wrong is left out. False when
  /// the bytes are no OpenIGTLink: the connection cannot be read on.
  bool read(std::span<const uint8_t> bytes, const std::function<void(const IgtlReceived&)>& on_message);

 private:
  bool header_done();
  bool body_done();

  std::vector<uint8_t> kept_;
  bool in_body_ = false;
  uint64_t wanted_ = 58;  ///< bytes still to be kept
  uint64_t to_skip_ = 0;
  uint16_t version_ = 0;
  uint64_t crc_ = 0;
  IgtlReceived message_;
};

}  // namespace palpate
