#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/run.h"
#include "app/verbs.h"

namespace palpate::app {

void add_estimate(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, folder = "palpate_estimate", truth;
    bool json = false, realtime = false, openigtlink = false, ros2 = false, force_loop = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      app.add_subcommand("estimate", "Both stages: two videos in, forces.csv, overlay.mp4, report.html out");
  verb->add_option("scene", arguments->scene, "scene.yaml")->required()->type_name("SCENE");
  verb->add_option("-o,--output", arguments->folder, "folder for the results")
      ->type_name("FOLDER")
      ->capture_default_str();
  verb->add_option("--truth", arguments->truth, "truth.csv to compare with in the report")->type_name("FILE");
  verb->add_flag("--realtime", arguments->realtime, "play the recording at its own rate");
  verb->add_flag("--openigtlink", arguments->openigtlink, "serve OpenIGTLink, as streams.openigtlink says");
  verb->add_flag("--ros2", arguments->ros2, "publish to ROS 2, as streams.ros2 says");
  verb->add_flag("--force-loop", arguments->force_loop, "answer at 1 kHz over UDP, as streams.force_loop says");
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer("Example: palpate estimate scene.yaml -o results --truth truth.csv");
  verb->callback([arguments] {
    SceneFile scene_file = read_scene_file(arguments->scene, true);
    StreamOptions& streams = scene_file.streams;
    streams.has_openigtlink |= arguments->openigtlink;
    streams.has_ros2 |= arguments->ros2;
    streams.has_force_loop |= arguments->force_loop;
    scene_file.has_streams = streams.any();
    const RunSummary summary =
        run_estimate(scene_file, {arguments->folder, arguments->truth, arguments->json, arguments->realtime});
    fmt::print("{}", arguments->json ? json_success(to_json(summary)) : to_text(summary));
  });
}

}  // namespace palpate::app
