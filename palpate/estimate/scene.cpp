#include "palpate/estimate/scene.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/core/settings_file.h"

namespace palpate {

namespace {

/// What the scene file will hold one day.
const std::vector<std::string> kInstrumentKeysNotYet = {"[1]"};
const std::vector<std::string> kSceneKeysNotYet = {"instruments", "instrument_2"};

void check_map(const MapOptions& options) {
  constexpr double kMaxFrames = 100;
  const auto [first, last] = std::pair{options.frames.x, options.frames.y};
  if (first < 0 || last < first || last - first >= kMaxFrames || first != std::floor(first) || last != std::floor(last))
    throw BadInput(fmt::format(
        "map.frames is [{:g}, {:g}], expected the first and the last of at most {:g} frames, counted from 0", first,
        last, kMaxFrames));
  if (options.has_focus && !options.focus_px.empty())
    throw BadInput("map has both focus and focus_px, expected one of them");
  if (options.register_volume && options.volume.empty())
    throw BadInput("map.register needs map.volume, the body that is to be registered");
  const Mat3& R = options.register_from.left_from_volume;
  if (!(R * R.transpose()).isIdentity(0.01) || R.determinant() < 0)
    throw BadInput("map.register_from.rotation is no rotation");
}

}  // namespace

void describe(Settings& settings, MapOptions& options) {
  settings.integer("frame", options.frame, {0, 1e9}, "the static frame that the map is built from, counted from 0");
  settings.pixel(
      "frames", options.frames,
      "[first, last] frame of a phase in which camera and tissue stand still: their depths are fused, and the "
      "last of them is the map's frame");
  settings.integer("elements", options.elements, {100, 200000}, "n of Eq. 1, tetrahedra wanted");
  settings.polygon("organ_region_px", options.organ_region_px,
                   "outline of the organ in the left image as recorded; everything when left out");
  settings.number("thickness_mm", options.thickness_mm, {0, 500, true, false},
                  "depth of the body behind its visible surface, along the optical axis; of a rounded organ the mean "
                  "(volume over shadow)");
  settings.path(
      "volume", options.volume,
      "instead of the thickness: the organ from a scan (.msh .vtk .vtu .vtp .obj .ply .stl), left camera frame");
  settings.choice<LengthUnit>("volume_unit", options.volume_unit, {{"mm", LengthUnit::mm}, {"m", LengthUnit::m}},
                              "unit of length of that file");
  settings.choice<Element>(
      "element", options.element, {{"averaged", Element::averaged}, {"linear", Element::linear}},
      "averaged: the volume ratio averaged around each node, free of locking; linear: the paper's plain tetrahedra");
  settings.flag("register", options.register_volume,
                "move the volume, as a rigid body, to where the tissue was measured");
  settings.group(
      "register_from", "where the volume lies roughly: p_left = rotation p + translation; else equal middles are tried",
      [&options](Settings& group) {
        group.matrix3("rotation", options.register_from.left_from_volume, "row by row");
        group.vector3("translation_mm", options.register_from.left_from_volume_mm, {-1e4, 1e4}, "left camera frame");
      },
      &options.has_register_from);
  settings.number("register_limit_mm", options.register_limit_mm, {0, 100, true, false},
                  "largest residual (root mean square) of the registration; beyond, the map is refused");
  settings.polygon("focus_px", options.focus_px,
                   "part of the left image as recorded where the elements are finer, in the same total number");
  settings.group(
      "focus", "or: a ball in which the elements are finer",
      [&options](Settings& group) {
        group.vector3("center_mm", options.focus_center_mm, {-1e4, 1e4}, "middle, left camera frame");
        group.number("radius_mm", options.focus_radius_mm, {0, 1000, true, false}, "radius");
        group.require("center_mm");
        group.require("radius_mm");
      },
      &options.has_focus);
  settings.number("focus_edge_ratio", options.focus_edge_ratio, {0.1, 1},
                  "length of the edges there against that far away");
  describe(settings, options.labels);
  settings.after_reading([&options] {
    check_map(options);
    if (options.frames.x < options.frames.y) options.frame = static_cast<int>(options.frames.y);
  });
  describe(settings, options.match);
  describe(settings, options.surface);
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
  settings.group("uncertainty", "what is not known of the tissue, one standard deviation each: widens the total band",
                 [&scene](Settings& group) { describe(group, scene.uncertainty); });
  settings.group(
      "tuning", "numbers that the inference (docs/inference.md) and the map (docs/map.md) decide by",
      [&scene](Settings& group) {
        describe(group, scene.tuning);
        describe(group, scene.map.edges);
      },
      &scene.has_tuning);
  settings.after_reading([&scene] {
    if (!scene.contact.at_px.empty() && (scene.instrument.segmentation != "none" || !scene.instrument.track.empty()))
      throw BadInput(
          "contact.at_px says where tissue is held when no instrument is looked for, expected instrument.segmentation: "
          "none (and no instrument.track) beside it");
    if (scene.tissue.modulus_unknown && !scene.map.labels.empty())
      throw BadInput(
          "tissue.young_modulus_kPa is unknown while map.labels states moduli in kPa, expected a number for both");
  });
}

Scene read_scene(const std::filesystem::path& file) {
  Scene scene;
  Settings settings;
  settings.group("recording", "the two videos and their calibration",
                 [&scene](Settings& group) { describe(group, scene.recording); });
  settings.require("recording");
  describe(settings, scene);
  YAML::Node root = load_settings_file(file);
  if (root.IsMap())
    for (const char* key : {"overlay", "simulate", "streams", "run"}) root.remove(key);
  read_settings(root, {file, std::filesystem::absolute(file).parent_path()}, settings);
  return scene;
}

}  // namespace palpate
