#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/run.h"
#include "app/verbs.h"
#include "palpate/feedback/map_json.h"
#include "palpate/session/clear_results.h"
#include "palpate/session/output_folder.h"
#include "palpate/session/root_folder.h"

namespace palpate::app {

void add_map(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, folder = "palpate_map";
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("map", "Build stage: map.vtu, surface.ply, cloud.ply, preview.png, map.json");
  verb->add_option("scene", arguments->scene, "scene.yaml")->required()->type_name("SCENE");
  verb->add_option("-o,--output", arguments->folder, "folder for the results")
      ->type_name("FOLDER")
      ->capture_default_str();
  verb->add_flag("--json", arguments->json, "map.json on standard output too, no progress");
  verb->footer("Example: palpate map scene.yaml -o map");
  verb->callback([arguments] {
    const SceneFile scene_file = read_scene_file(arguments->scene, true);
    require_output_folder(arguments->folder);
    const BuiltMap built = build_map(scene_file, arguments->json);
    begin_results(arguments->folder, sources_of(scene_file));
    write_map_files(built, arguments->folder);
    if (arguments->json) {
      auto json = nlohmann::ordered_json::parse(map_json(built.map, built.rectification));
      json["folder"] = arguments->folder.string();
      fmt::print("{}", json_success(json));
      return;
    }
    const MapReport& report = built.map.report;
    fmt::print("points       {} ({:.0f} % of the organ region), depth deviation {:.2f} mm median\n",
               report.matched_points, 100 * report.coverage, report.median_depth_deviation_mm);
    fmt::print("surface      {} triangles, {} other pieces\n", built.map.surface.triangles.size(),
               built.map.pieces.size() - 1);
    fmt::print("volume       {} tetrahedra, smallest dihedral angle {:.1f} degrees, {} of {} nodes attached\n",
               built.map.mesh.tetrahedra.size(), report.mesh.smallest_dihedral_deg, built.map.fixed_nodes.size(),
               built.map.mesh.nodes_mm.size());
    fmt::print(
        "time         rectify {:.0f}, match {:.0f}, triangulate {:.0f}, edges {:.0f}, surface {:.0f}, volume "
        "{:.0f}, attachments {:.0f} ms\n",
        report.rectify_ms, report.match_ms, report.triangulate_ms, report.edges_ms, report.surface_ms, report.volume_ms,
        report.attachments_ms);
    fmt::print("written to   {}\n", arguments->folder.string());
  });
}

}  // namespace palpate::app
