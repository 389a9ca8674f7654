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

nlohmann::ordered_json to_json(const SensorComparison& found) {
  nlohmann::ordered_json axes = nlohmann::ordered_json::array();
  for (int row = 0; row < 3; ++row)
    axes.push_back(
        {found.camera_from_sensor(row, 0), found.camera_from_sensor(row, 1), found.camera_from_sensor(row, 2)});
  return {{"frames", found.frames},
          {"delay_s", found.delay_s},
          {"camera_from_sensor", axes},
          {"sensor_peak_N", found.sensor_peak_N},
          {"force_rmse_N", found.rmse_N},
          {"force_nrmse_pct", found.nrmse_pct},
          {"scale", found.scale},
          {"force_rmse_scaled_N", found.rmse_scaled_N},
          {"force_nrmse_scaled_pct", found.nrmse_scaled_pct},
          {"force_correlation", found.correlation}};
}

std::string to_text(const SensorComparison& found) {
  return fmt::format(
      "sensor's clock        {:+.3f} s against the video's, found by correlation\n"
      "force RMSE            {:.3f} N, {:.1f} % of the sensor's peak of {:.2f} N\n"
      "after one factor      {:.3f} N, {:.1f} %, with the estimate times {:.3f}\n"
      "correlation           {:.4f} over {} frames\n",
      found.delay_s, found.rmse_N, found.nrmse_pct, found.sensor_peak_N, found.rmse_scaled_N, found.nrmse_scaled_pct,
      found.scale, found.correlation, found.frames);
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
      const SensorComparison found =
          compare_with_sensor(read_forces(arguments->forces), read_sensor_log(arguments->sensor));
      fmt::print("{}", arguments->json ? json_success(to_json(found)) : to_text(found));
      return;
    }
    if (arguments->truth.empty()) throw WrongUse("compare needs truth.csv, or --sensor with a sensor's log");
    const Comparison comparison = compare(read_forces(arguments->forces), read_truth(arguments->truth));
    fmt::print(
        "{}", arguments->json ? json_success(nlohmann::ordered_json::parse(to_json(comparison))) : to_text(comparison));
  });
}

}  // namespace palpate::app
