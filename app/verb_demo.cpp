#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/run.h"
#include "app/simulation.h"
#include "app/verbs.h"
#include "palpate/session/output_folder.h"

namespace palpate::app {

void add_demo(CLI::App& app) {
  struct Arguments {
    std::filesystem::path folder = "palpate_demo";
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      app.add_subcommand("demo", "The main job on a sequence that it makes itself: simulate, estimate, compare");
  verb->add_option("-o,--output", arguments->folder, "folder for the sequence and the results")
      ->type_name("FOLDER")
      ->capture_default_str();
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer("Example: palpate demo -o demo && xdg-open demo/report.html");
  verb->callback([arguments] {
    require_output_folder(arguments->folder);
    const std::filesystem::path recording = arguments->folder / "recording";
    DejaVuSummary simulated;
    const SceneFile scene_file = simulate_into(demo_scene(), recording, arguments->json, simulated);
    const RunSummary summary = run_estimate(scene_file, {arguments->folder, recording / "truth.csv", arguments->json});
    if (arguments->json) {
      fmt::print("{}", json_success(to_json(summary)));
      return;
    }
    fmt::print("\n{}{:<22}{}\n", to_text(summary), "look at", (arguments->folder / "report.html").string());
  });
}

}  // namespace palpate::app
