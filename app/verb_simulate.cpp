#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/simulation.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/session/output_folder.h"

namespace palpate::app {

void add_simulate(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, folder = "palpate_simulate";
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("simulate", "DejaVu: makes stereo video with known force, and its scene.yaml");
  verb->add_option("scene", arguments->scene, "scene file with a simulate part")->required()->type_name("SCENE");
  verb->add_option("-o,--output", arguments->folder, "folder for the sequence")
      ->type_name("FOLDER")
      ->capture_default_str();
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer(
      "Example: palpate simulate studies/uterus.yaml -o uterus && palpate estimate uterus/scene.yaml -o results");
  verb->callback([arguments] {
    const SceneFile scene_file = read_scene_file(arguments->scene, false);
    if (!scene_file.has_simulate)
      throw BadInput(fmt::format("{}: simulate is missing (what DejaVu makes)", arguments->scene.string()));
    require_output_folder(arguments->folder);
    DejaVuSummary summary;
    simulate_into(scene_file, arguments->folder, arguments->json, summary);
    if (arguments->json) {
      fmt::print("{}", json_success({{"folder", arguments->folder.string()},
                                     {"frames", summary.frames},
                                     {"truth_elements", summary.truth_elements},
                                     {"peak_force_N", summary.peak_force_N},
                                     {"largest_residual", summary.largest_residual}}));
      return;
    }
    fmt::print("{} frames, truth of {} tetrahedra, peak force {:.2f} N in frame {}\nwritten to {}\n", summary.frames,
               summary.truth_elements, summary.peak_force_N, summary.peak_frame, arguments->folder.string());
  });
}

}  // namespace palpate::app
