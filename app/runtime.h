#pragma once

#include <atomic>

namespace palpate::app {

/// OpenBLAS falls back to a very old core type on virtual machines and reads its choice before main: where the
/// environment does not choose, the program starts itself again with the core type of this processor and one BLAS
/// thread.
void choose_blas_core(char** argv);

/// Set by Ctrl-C; long work looks at it, keeps what is done and ends with exit code 4.
const std::atomic<bool>& interrupted();
void watch_for_interrupt();

}  // namespace palpate::app
