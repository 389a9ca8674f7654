#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/run.h"
#include "app/verbs.h"

namespace palpate::app {

void add_check(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("check", "Says what is wrong with an input before anything runs; writes nothing");
  verb->add_option("scene", arguments->scene, "scene.yaml")->required();
  verb->add_flag("--json", arguments->json, "answer as JSON");
  verb->footer("Example: palpate check scene.yaml");
  verb->callback([arguments] {
    const SceneFile scene_file = read_scene_file(arguments->scene, true);
    if (!scene_file.scene.instrument.track.empty()) read_tip_track(scene_file.scene.instrument.track);
    const BuiltMap built = build_map(scene_file, arguments->json);
    if (arguments->json) {
      fmt::print("{}\n", nlohmann::json{{"ok", true}, {"elements", built.map.mesh.tetrahedra.size()}}.dump());
      return;
    }
    fmt::print("{}: fine. {} points ({:.0f} % of the organ region), {} tetrahedra, {} attached nodes.\n",
               arguments->scene.string(), built.map.cloud.size(), 100 * built.map.report.coverage,
               built.map.mesh.tetrahedra.size(), built.map.fixed_nodes.size());
  });
}

}  // namespace palpate::app
