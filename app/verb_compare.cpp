#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/feedback/compare.h"
#include "palpate/feedback/sensor_log.h"

namespace palpate::app {

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
      const std::vector<ForceRow> forces = read_forces(arguments->forces);
      const double span_s = forces.empty() ? 0 : forces.back().time_s - forces.front().time_s;
      const SensorComparison found = compare_with_sensor(forces, read_sensor_log(arguments->sensor, span_s));
      fmt::print("{}", arguments->json ? json_success(nlohmann::ordered_json::parse(to_json(found))) : to_text(found));
      return;
    }
    if (arguments->truth.empty()) throw WrongUse("compare needs truth.csv, or --sensor with a sensor's log");
    const Comparison comparison = compare(read_forces(arguments->forces), read_truth(arguments->truth));
    fmt::print(
        "{}", arguments->json ? json_success(nlohmann::ordered_json::parse(to_json(comparison))) : to_text(comparison));
  });
}

}  // namespace palpate::app
