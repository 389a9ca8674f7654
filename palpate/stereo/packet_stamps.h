#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// Of what carries no stamp; FFmpeg's AV_NOPTS_VALUE.
constexpr int64_t kNoStamp = INT64_MIN;

/// When a packet of a video is shown and when it is decoded, in ticks of its stream; each may be kNoStamp.
struct PacketStamp {
  int64_t shown = kNoStamp;
  int64_t decoded = kNoStamp;
};

/// Recordings that were joined without a look at their stamps (`cat a.ts b.ts`): each begins with a time of its own.
class JoinedParts {
 public:
  /// `frame` is how long one is shown, ticks.
  explicit JoinedParts(int64_t frame) : frame_(frame) {}
  /// Packets of one stream in the order of the file. Where time jumps back, the stamps from there on are moved so that
  /// the part begins a frame after the last one. Returns whether a part begins with this packet.
  bool join(PacketStamp& stamp);

 private:
  int64_t frame_;
  int64_t shift_ = 0;
  int64_t decoded_ = kNoStamp;  ///< of the packet before, as the file has it
  int64_t last_ = kNoStamp;     ///< the latest so far, moved
};

/// When frames are shown, ascending, one for each packet. Packets that carry no stamp of showing (MPEG-PS, AVI) have
/// that which their place in the order of decoding says; without any, they are a frame apart.
std::vector<int64_t> shown_stamps(const std::vector<PacketStamp>& packets, int64_t frame);

}  // namespace palpate
