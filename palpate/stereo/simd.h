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
  using Eight = float __attribute__((vector_size(8 * sizeof(float))));
  Eight a, b;
  std::memcpy(&a, first, sizeof(a));
  std::memcpy(&b, second, sizeof(b));
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

inline void store_lanes(const FloatLanes& lanes, float* to) {
  std::memcpy(to, &lanes, sizeof(lanes));
}

inline FloatLanes all_of_simd(float number) {
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
  const auto eight = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3, 4, 5, 6, 7) +
                     __builtin_shufflevector(lanes, lanes, 8, 9, 10, 11, 12, 13, 14, 15);
  const auto four =
      __builtin_shufflevector(eight, eight, 0, 1, 2, 3) + __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
  return (four[0] + four[2]) + (four[1] + four[3]);
}

}  // namespace palpate
