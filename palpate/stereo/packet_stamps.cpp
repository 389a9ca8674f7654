#include "palpate/stereo/packet_stamps.h"

#include <algorithm>

namespace palpate {

bool JoinedParts::join(PacketStamp& stamp) {
  const bool begins = stamp.decoded != kNoStamp && decoded_ != kNoStamp && stamp.decoded < decoded_ - frame_;
  if (stamp.decoded != kNoStamp) decoded_ = stamp.decoded;
  if (begins) shift_ = last_ + frame_ - (stamp.shown != kNoStamp ? stamp.shown : stamp.decoded);
  for (int64_t* ticks : {&stamp.shown, &stamp.decoded}) {
    if (*ticks == kNoStamp) continue;
    *ticks += shift_;
    last_ = std::max(last_, *ticks);
  }
  return begins;
}

std::vector<int64_t> shown_stamps(const std::vector<PacketStamp>& packets, int64_t frame) {
  std::vector<int64_t> shown, decoded;
  for (const PacketStamp& packet : packets) {
    if (packet.shown != kNoStamp) shown.push_back(packet.shown);
    if (packet.decoded != kNoStamp) decoded.push_back(packet.decoded);
  }
  std::sort(shown.begin(), shown.end());
  if (shown.size() == packets.size()) return shown;
  // Frames are shown at the same steps as they are decoded, later by what the first one waits.
  std::sort(decoded.begin(), decoded.end());
  const int64_t wait = shown.empty() || decoded.empty() ? 0 : shown.front() - decoded.front();
  std::vector<int64_t> all = shown;
  for (const int64_t ticks : decoded) {
    if (all.size() == packets.size()) break;
    const auto after = std::lower_bound(shown.begin(), shown.end(), ticks + wait - frame / 2);
    if (after == shown.end() || *after > ticks + wait + frame / 2) all.push_back(ticks + wait);
  }
  std::sort(all.begin(), all.end());
  while (all.size() < packets.size()) all.push_back(all.empty() ? 0 : all.back() + frame);
  return all;
}

}  // namespace palpate
