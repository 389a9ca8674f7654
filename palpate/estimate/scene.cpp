#include "palpate/estimate/scene.h"

namespace palpate {

namespace {

/// What the scene file will hold one day.
const std::vector<std::string> kMapKeysNotYet = {"frames", "register", "focus_px", "focus", "labels"};
const std::vector<std::string> kInstrumentKeysNotYet = {"camera_from_robot", "time_offset_s", "[1]"};
const std::vector<std::string> kSceneKeysNotYet = {"instruments", "instrument_2"};

}  // namespace

void describe(Settings& settings, MapOptions& options) {
  settings.integer("frame", options.frame, {0, 1e9}, "the static frame that the map is built from, counted from 0");
  settings.integer("elements", options.elements, {100, 200000}, "n of Eq. 1, tetrahedra wanted");
  settings.polygon("organ_region_px", options.organ_region_px,
                   "outline of the organ in the left image as recorded; everything when left out");
  settings.number("thickness_mm", options.thickness_mm, {0, 500, true, false},
                  "depth of the body behind its visible surface, along the optical axis");
  settings.path("volume", options.volume,
                "instead of the thickness: the organ from a scan (.msh .vtk .vtu .obj .ply .stl), left camera frame");
  settings.choice<LengthUnit>("volume_unit", options.volume_unit, {{"mm", LengthUnit::mm}, {"m", LengthUnit::m}},
                              "unit of length of that file");
  settings.choice<Element>(
      "element", options.element, {{"averaged", Element::averaged}, {"linear", Element::linear}},
      "averaged: the volume ratio averaged around each node, free of locking; linear: the paper's plain tetrahedra");
  describe(settings, options.match);
  describe(settings, options.surface);
  settings.not_yet(kMapKeysNotYet);
}

void describe(Settings& settings, Scene& scene) {
  settings.group("map", "the build stage", [&scene](Settings& group) { describe(group, scene.map); });
  settings.group("tissue", "gamma of Eq. 1: law and constants",
                 [&scene](Settings& group) { describe(group, scene.tissue); });
  settings.require("tissue");
  describe(settings, scene.attachments);
  settings.group("instrument", "how the tip is found", [&scene](Settings& group) {
    describe(group, scene.instrument);
    group.not_yet(kInstrumentKeysNotYet);
  });
  settings.not_yet(kSceneKeysNotYet);
  settings.group("contact", "when and how the tip holds the tissue",
                 [&scene](Settings& group) { describe(group, scene.contact); });
}

Scene read_scene(const std::filesystem::path& file) {
  Scene scene;
  Settings settings;
  settings.group("recording", "the two videos and their calibration",
                 [&scene](Settings& group) { describe(group, scene.recording); });
  settings.require("recording");
  describe(settings, scene);
  read_settings_file(file, settings);
  return scene;
}

}  // namespace palpate
