#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "app/runtime.h"

namespace {

/// "Assembly, averaged": the second argument is the element.
std::string name_of(const benchmark::BenchmarkName& name) {
  const size_t slash = name.args.find('/');
  if (slash == std::string::npos) return name.function_name;
  return name.function_name + (name.args[slash + 1] == '0' ? ", linear" : ", averaged");
}

/// A Markdown table with the goal beside what was measured; other counters behind.
class TableReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override {
    fmt::print("| what | elements | median ms | 99 % ms | goal ms | |\n|---|---|---|---|---|---|\n");
    return true;
  }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.error_occurred) {
        fmt::print("| {} | | | | | {} |\n", run.benchmark_name(), run.error_message);
        continue;
      }
      const auto number = [&run](const char* name) {
        const auto found = run.counters.find(name);
        return found == run.counters.end() ? std::string() : fmt::format("{:.4g}", found->second.value);
      };
      std::string rest = run.report_label;
      for (const auto& [name, counter] : run.counters)
        if (name != "elements" && name != "median_ms" && name != "p99_ms" && name != "goal_ms")
          rest += fmt::format("{}{} {:.3g}", rest.empty() ? "" : ", ", name, counter.value);
      fmt::print("| {} | {} | {} | {} | {} | {} |\n", name_of(run.run_name), number("elements"), number("median_ms"),
                 number("p99_ms"), number("goal_ms"), rest);
      std::fflush(stdout);
    }
  }
};

}  // namespace

int main(int argc, char** argv) {
  palpate::app::choose_blas_core(argv);
  benchmark::Initialize(&argc, argv);
  TableReporter table;
  benchmark::RunSpecifiedBenchmarks(&table);
  return 0;
}
