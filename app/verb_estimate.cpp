#include <fmt/format.h>

#include <memory>

#include "app/run.h"
#include "app/verbs.h"

namespace palpate::app {

void add_estimate(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, folder = "palpate_estimate", truth;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      app.add_subcommand("estimate", "Both stages: two videos in, forces.csv, overlay.mp4, report.html out");
  verb->add_option("scene", arguments->scene, "scene.yaml")->required();
  verb->add_option("-o,--output", arguments->folder, "folder for the results")->capture_default_str();
  verb->add_option("--truth", arguments->truth, "truth.csv to compare with in the report");
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer("Example: palpate estimate scene.yaml -o results --truth truth.csv");
  verb->callback([arguments] {
    const SceneFile scene_file = read_scene_file(arguments->scene, true);
    const RunSummary summary = run_estimate(scene_file, {arguments->folder, arguments->truth, arguments->json});
    fmt::print("{}", arguments->json ? to_json(summary) : to_text(summary));
    if (!arguments->json) fmt::print("{:<22}{}\n", "written to", arguments->folder.string());
  });
}

}  // namespace palpate::app
