#include "palpate/stream/force_record.h"

#include <zlib.h>

#include <bit>
#include <cstring>

namespace palpate {

static_assert(std::endian::native == std::endian::little);

namespace {

constexpr uint32_t kMagic = 0x464C4150;  // "PALF"
constexpr uint16_t kVersion = 1;
constexpr size_t kChecked = 60;

enum Flag : uint16_t { valid = 1, in_contact = 2, limited = 4, damped = 8, frames_late = 16 };

template <class T>
void put(ForceRecord& record, size_t at, const T& value) {
  std::memcpy(record.data() + at, &value, sizeof value);
}

template <class T>
void get(std::span<const uint8_t> bytes, size_t at, T& value) {
  std::memcpy(&value, bytes.data() + at, sizeof value);
}

uint32_t checksum(std::span<const uint8_t> bytes) {
  return static_cast<uint32_t>(crc32(0, bytes.data(), kChecked));
}

}  // namespace

ForceRecord to_record(const ForceSample& sample) {
  ForceRecord record{};
  uint16_t flags = 0;
  if (sample.valid) flags |= Flag::valid;
  if (sample.in_contact) flags |= Flag::in_contact;
  if (sample.limited) flags |= Flag::limited;
  if (sample.damped) flags |= Flag::damped;
  if (sample.frames_late) flags |= Flag::frames_late;
  put(record, 0, kMagic);
  put(record, 4, kVersion);
  put(record, 6, flags);
  put(record, 8, sample.sequence);
  put(record, 16, sample.wall_ns);
  put(record, 24, sample.force_N);
  put(record, 36, sample.tip_mm);
  put(record, 48, sample.stiffness_N_per_mm);
  put(record, 52, sample.frame);
  put(record, 56, sample.frame_age_us);
  put(record, kChecked, checksum(record));
  return record;
}

std::optional<ForceSample> from_record(std::span<const uint8_t> bytes) {
  if (bytes.size() != sizeof(ForceRecord)) return std::nullopt;
  uint32_t magic, sum;
  uint16_t version, flags;
  get(bytes, 0, magic);
  get(bytes, 4, version);
  get(bytes, 6, flags);
  get(bytes, kChecked, sum);
  if (magic != kMagic || version != kVersion || sum != checksum(bytes)) return std::nullopt;
  ForceSample sample;
  sample.valid = flags & Flag::valid;
  sample.in_contact = flags & Flag::in_contact;
  sample.limited = flags & Flag::limited;
  sample.damped = flags & Flag::damped;
  sample.frames_late = flags & Flag::frames_late;
  get(bytes, 8, sample.sequence);
  get(bytes, 16, sample.wall_ns);
  get(bytes, 24, sample.force_N);
  get(bytes, 36, sample.tip_mm);
  get(bytes, 48, sample.stiffness_N_per_mm);
  get(bytes, 52, sample.frame);
  get(bytes, 56, sample.frame_age_us);
  return sample;
}

}  // namespace palpate
