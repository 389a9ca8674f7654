#include <fmt/format.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/check_pictures.h"
#include "app/recording_check.h"
#include "app/run.h"
#include "app/track_check.h"
#include "app/verbs.h"
#include "palpate/instrument/instrument_finder.h"
#include "palpate/session/output_folder.h"
#include "palpate/stereo/read_through.h"

namespace palpate::app {

namespace {

/// For looking at all pictures of a recording.
constexpr double kPatience_s = 10;

std::vector<std::string> attachment_kinds(const AttachmentOptions& attachments) {
  using Kind = AttachmentRegion::Kind;
  const std::map<Kind, std::string> names = {{Kind::underside, "underside"},
                                             {Kind::box, "box"},
                                             {Kind::oriented_box, "oriented_box"},
                                             {Kind::sphere, "sphere"},
                                             {Kind::polygon, "polygon_px"}};
  std::vector<std::string> kinds;
  for (const AttachmentRegion& region : attachments.regions)
    if (names.count(region.kind)) kinds.push_back(names.at(region.kind));
  return kinds;
}

nlohmann::ordered_json json_of(const SceneFile& scene_file, const BuiltMap& built) {
  const StereoRig& rig = built.rectification.rig;
  const cv::Size size = built.frame.left.size();
  const cv::Point2d field = field_of_view_deg(rig.left, size);
  nlohmann::ordered_json json;
  json["scene"] = scene_file.file.string();
  json["recording"] = {{"image_size_px", {size.width, size.height}}, {"fps", built.fps}};
  json["recording"]["frames"] = built.frame_count >= 0 ? nlohmann::ordered_json(built.frame_count) : nullptr;
  json["recording"].update(timing_json(built.timing, built.notes));
  json["calibration"] = {
      {"focal_px", rig.left.K(0, 0)}, {"baseline_mm", rig.baseline_mm()}, {"field_of_view_deg", {field.x, field.y}}};
  json["tissue"] = tissue_json(scene_file.scene.tissue);
  json["attachments"] = attachment_kinds(scene_file.scene.attachments);
  json["points"] = built.map.cloud.size();
  json["coverage"] = built.map.report.coverage;
  json["elements"] = built.map.mesh.tetrahedra.size();
  json["fixed_nodes"] = built.map.fixed_nodes.size();
  return json;
}

/// What would go better, though nothing is wrong; empty where nothing is to be said.
std::string advice_for(const Scene& scene) {
  const Law law = scene.tissue.law;
  if (scene.contact.grip == Grip::push &&
      (law == Law::saint_venant_kirchhoff || law == Law::saint_venant_kirchhoff_barrier))
    return fmt::format(
        "tissue.law is {}, which loses its stiffness where tissue is pressed: for a push neo-hookean "
        "keeps it",
        law_name(law));
  return {};
}

}  // namespace

void add_check(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, folder;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      app.add_subcommand("check",
                         "Says what is wrong with an input before anything runs, and how a tip track lies to the "
                         "video; writes nothing without -o");
  verb->add_option("scene", arguments->scene, "scene.yaml")->required()->type_name("SCENE");
  verb->add_option("-o,--output", arguments->folder,
                   "folder for instruments.png (masks and tips of ten frames) and rectified.png (row lines)")
      ->type_name("FOLDER");
  verb->add_flag("--json", arguments->json, "answer as JSON");
  verb->footer("Example: palpate check scene.yaml -o check");
  verb->callback([arguments] {
    const SceneFile scene_file = read_scene_file(arguments->scene, true);
    if (!arguments->folder.empty()) require_output_folder(arguments->folder);
    BuiltMap built = build_map(scene_file, arguments->json);
    // A network that cannot run is said here, not after the map of a run.
    const InstrumentFinder finder(scene_file.scene.instrument, built.frame.left, built.map.organ_mask);
    for (const std::string& note : read_through(scene_file.scene.recording, kPatience_s)) {
      if (!arguments->json) fmt::print(stderr, "note        {}\n", note);
      built.notes.push_back(note);
    }
    std::optional<TrackCheck> track;
    if (const InstrumentOptions& instrument = scene_file.scene.instrument;
        !instrument.track.empty() && !instrument.has_live_track() && !built.timing.is_live)
      track = check_track(scene_file, built, arguments->json);
    if (!arguments->folder.empty()) write_check_pictures(scene_file, built, arguments->folder, arguments->json);
    if (arguments->json) {
      nlohmann::ordered_json json = json_of(scene_file, built);
      if (!arguments->folder.empty()) json["folder"] = arguments->folder.string();
      if (track) json["track"] = to_json(*track);
      if (const std::string advice = advice_for(scene_file.scene); !advice.empty()) json["advice"] = advice;
      fmt::print("{}", json_success(json));
      return;
    }
    fmt::print("{}: fine. {} points ({:.0f} % of the organ region), {} tetrahedra, {} attached nodes.\n",
               arguments->scene.string(), built.map.cloud.size(), 100 * built.map.report.coverage,
               built.map.mesh.tetrahedra.size(), built.map.fixed_nodes.size());
    if (track) fmt::print("{}", to_text(*track));
    if (const std::string advice = advice_for(scene_file.scene); !advice.empty()) fmt::print("advice: {}\n", advice);
    if (!arguments->folder.empty()) fmt::print("written to {}\n", arguments->folder.string());
  });
}

}  // namespace palpate::app
