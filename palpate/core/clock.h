#pragma once

#include <cstdint>
#include <ctime>

namespace palpate {

/// ns of a clock that never jumps: everything that is waited for or compared.
inline int64_t steady_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

/// ns since 1970: the stamps that other programs read. It may jump.
inline int64_t wall_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

}  // namespace palpate
