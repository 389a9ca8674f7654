#pragma once

#include <cstring>

namespace palpate {

/// Sixteen numbers side by side, which the compiler turns into the processor's vector instructions.
using FloatLanes = float __attribute__((vector_size(16 * sizeof(float))));
using IntLanes = int __attribute__((vector_size(16 * sizeof(int))));
constexpr int kLanes = 16;

inline FloatLanes load_lanes(const float* from) {
  FloatLanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

/// Eight numbers from here, eight from there.
inline FloatLanes load_halves(const float* first, const float* second) {
  FloatLanes lanes;
  std::memcpy(&lanes, first, sizeof(lanes) / 2);
  std::memcpy(reinterpret_cast<char*>(&lanes) + sizeof(lanes) / 2, second, sizeof(lanes) / 2);
  return lanes;
}

inline void store_lanes(const FloatLanes& lanes, float* to) {
  std::memcpy(to, &lanes, sizeof(lanes));
}

inline FloatLanes all_lanes(float number) {
  return number - FloatLanes{};
}

/// from[index] of every lane.
inline FloatLanes gather(const float* from, const IntLanes& index) {
  int at[kLanes];
  float found[kLanes];
  std::memcpy(at, &index, sizeof(index));
  for (int i = 0; i < kLanes; ++i) found[i] = from[at[i]];
  return load_lanes(found);
}

/// Sum over the lanes, halves added to halves.
inline float total(const FloatLanes& lanes) {
  using Eight = float __attribute__((vector_size(8 * sizeof(float))));
  using Four = float __attribute__((vector_size(4 * sizeof(float))));
  Eight eights[2];
  std::memcpy(eights, &lanes, sizeof(lanes));
  const Eight eight = eights[0] + eights[1];
  Four fours[2];
  std::memcpy(fours, &eight, sizeof(eight));
  const Four four = fours[0] + fours[1];
  return (four[0] + four[2]) + (four[1] + four[3]);
}

}  // namespace palpate
