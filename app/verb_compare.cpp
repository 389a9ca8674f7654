#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/feedback/compare.h"
#include "palpate/feedback/sensor_log.h"

namespace palpate::app {

namespace {

Comparison compare_files(const std::filesystem::path& forces, const std::filesystem::path& truth) {
  const std::vector<ForceRow> estimated = read_forces(forces), true_rows = read_truth(truth);
  try {
    return compare(estimated, true_rows);
  } catch (const BadInput& error) {
    throw BadInput(fmt::format("{} and {}: {}", truth.string(), forces.string(), error.what()));
  }
}

}  // namespace

void add_compare(CLI::App& app) {
  struct Arguments {
    std::filesystem::path forces, truth, sensor;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("compare", "Figures of forces.csv (of any estimator) against truth.csv");
  verb->add_option("forces", arguments->forces, "forces.csv")->required()->type_name("FILE");
  auto* truth = verb->add_option("truth", arguments->truth, "truth.csv")->type_name("FILE");
  verb->add_option(
          "--sensor", arguments->sensor,
          "instead of truth.csv: log of a force sensor (time_s, fx_N, fy_N, fz_N), with its own clock and axes")
      ->type_name("FILE")
      ->excludes(truth);
  verb->add_flag("--json", arguments->json, "figures as JSON");
  verb->footer("Example: palpate compare results/forces.csv truth.csv");
  verb->callback([arguments] {
    if (!arguments->sensor.empty()) {
      const SensorComparison found = compare_with_log(read_forces(arguments->forces), arguments->sensor);
      fmt::print("{}", arguments->json ? json_success(nlohmann::ordered_json::parse(to_json(found))) : to_text(found));
      return;
    }
    if (arguments->truth.empty()) throw WrongUse("compare needs truth.csv, or --sensor with a sensor's log");
    const Comparison comparison = compare_files(arguments->forces, arguments->truth);
    fmt::print(
        "{}", arguments->json ? json_success(nlohmann::ordered_json::parse(to_json(comparison))) : to_text(comparison));
  });
}

}  // namespace palpate::app
