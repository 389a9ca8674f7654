#include <benchmark/benchmark.h>

#include "app/runtime.h"

int main(int argc, char** argv) {
  palpate::app::choose_blas_core(argv);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
