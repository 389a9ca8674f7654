#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <vector>

namespace palpate::bench {

/// Times of single answers, for the table: median, 99 % and the goal beside them.
class Samples {
 public:
  template <class Function>
  void time(benchmark::State& state, Function f) {
    const auto start = std::chrono::steady_clock::now();
    f();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    state.SetIterationTime(seconds);
    ms_.push_back(1e3 * seconds);
  }

  /// `goal_ms`: of the median; 0 = none.
  void report(benchmark::State& state, int elements, double goal_ms) {
    std::sort(ms_.begin(), ms_.end());
    if (elements > 0) state.counters["elements"] = elements;
    state.counters["median_ms"] = at(0.5);
    state.counters["p99_ms"] = at(0.99);
    if (goal_ms > 0) state.counters["goal_ms"] = goal_ms;
  }

 private:
  double at(double fraction) const {
    return ms_[static_cast<size_t>(fraction * static_cast<double>(ms_.size() - 1) + 0.5)];
  }
  std::vector<double> ms_;
};

}  // namespace palpate::bench
