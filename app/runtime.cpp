#include "app/runtime.h"

#include <unistd.h>

#include <csignal>
#include <cstdlib>

namespace palpate::app {

namespace {

std::atomic<bool> g_interrupted{false};

const char* blas_core_of_this_processor() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    return "SkylakeX";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "Haswell";
#endif
  return nullptr;
}

}  // namespace

void choose_blas_core(char** argv) {
  const char* core = blas_core_of_this_processor();
  if (!core || std::getenv("OPENBLAS_CORETYPE")) return;
  setenv("OPENBLAS_CORETYPE", core, 1);
  setenv("OPENBLAS_NUM_THREADS", "1", 0);
  // FFmpeg inside OpenCV chatters about every stream that it probes.
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
  execv("/proc/self/exe", argv);
  // Without /proc the program goes on with whatever core OpenBLAS chose.
}

const std::atomic<bool>& interrupted() {
  return g_interrupted;
}

void watch_for_interrupt() {
  std::signal(SIGINT, [](int) {
    g_interrupted = true;
    std::signal(SIGINT, SIG_DFL);
  });
}

}  // namespace palpate::app
