#include "palpate/simulate/simulate_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "palpate/core/errors.h"
#include "palpate/simulate/gesture.h"

namespace palpate {
namespace {

const double kLargest_mm = 1000;

// A key that takes a word or a file: a name without extension has to be one of the words, and loses the folder that
// reading a path put before it.
void settle_word_or_file(const std::string& key, std::filesystem::path& value, const std::vector<std::string>& words) {
  if (value.has_extension()) return;
  const std::string name = value.filename().string();
  if (std::find(words.begin(), words.end(), name) == words.end()) {
    const std::string near = nearest_word(name, words);
    throw BadInput(fmt::format("{}: \"{}\" is neither {} nor a file{}", key, name, fmt::join(words, ", "),
                               near.empty() ? "" : "; did you mean \"" + near + "\"?"));
  }
  value = name;
}

void describe_body(Settings& settings, SimulatedBody& body) {
  settings.path(
      "shape", body.shape,
      "pear, slab, heart, or a file with a closed surface or a volume (.msh .vtk .vtu .obj .ply .stl, mm, left "
      "camera frame, size and place as they are in the file)");
  settings.vector3("size_mm", body.size_mm, {0, kLargest_mm, true}, "size of the shape before it is turned, mm");
  settings.vector3("center_mm", body.center_mm, {-kLargest_mm, kLargest_mm},
                   "middle of the shape, left camera frame, mm");
  settings.vector3("rotation_deg", body.rotation_deg, {-360, 360},
                   "turn about the camera's x axis, then y, then z, degrees");
  settings.integer("elements", body.elements, {100, 200000},
                   "tetrahedra of the true body, before it is refined at the contact");
  settings.after_reading([&body] {
    settle_word_or_file("simulate.body.shape", body.shape, {"pear", "slab", "heart"});
  });
}

void describe_light(Settings& settings, SimulatedLight& light) {
  settings.vector3("position_mm", light.position_mm, {-kLargest_mm, kLargest_mm},
                   "place of the light, measured from the middle between the cameras, mm");
  settings.number("radius_mm", light.radius_mm, {0, 100}, "radius of the light, softens shadows, mm");
  settings.number("reference_mm", light.reference_mm, {0, kLargest_mm, true},
                  "distance at which a white surface that faces the light is just white, mm");
}

void describe_noise(Settings& settings, SimulatedNoise& noise) {
  settings.number("read_levels", noise.read_levels, {0, 50}, "standard deviation in the dark, of 255 levels");
  settings.number("shot_levels", noise.shot_levels, {0, 50},
                  "what is added at white, of 255 levels; its variance grows with the level");
}

void describe_texture_source(Settings& settings, TextureSource& source) {
  settings.path("image", source.image, "left image as recorded, without instrument");
  settings.path("surface", source.surface, "surface that it shows, such as the surface.ply of palpate map, mm");
  settings.path("calibration", source.calibration, "of the cameras, as recording.calibration");
  settings.after_reading([&source] {
    if (source.image.empty() != source.surface.empty() || source.image.empty() != source.calibration.empty())
      throw BadInput("simulate.look.texture_from: needs image, surface and calibration, all three");
  });
}

void describe_border(Settings& settings, SimulatedBorder& border) {
  settings.number("radius_px", border.radius_px, {0, 10000},
                  "radius of the round field of view around the middle of the image, 0 = none, px");
  settings.number("blur_px", border.blur_px, {0, 1000}, "width of its blurred edge, px");
}

void describe_smoke(Settings& settings, SimulatedSmoke& smoke) {
  settings.number("density", smoke.density, {0, 10},
                  "light keeps exp(-density) of itself over 100 mm, and grey takes the place of the rest; 0 = none");
  settings.number("wisps", smoke.wisps, {0, 1}, "how uneven it is; wisps drift; 0 = even");
}

void describe_blood(Settings& settings, SimulatedBlood& blood) {
  settings.number("covered", blood.covered, {0, 0.9}, "fraction of the organ under patches of blood");
  settings.number("patch_mm", blood.patch_mm, {0, 100, true}, "size of a patch, mm");
}

void describe_look(Settings& settings, SimulatedLook& look) {
  settings.path("texture", look.texture, "procedural, or an image of tissue that is laid on from three sides");
  settings.number("texture_mm_per_px", look.texture_mm_per_px, {0, 10, true},
                  "size of one pixel of that image on the tissue, mm");
  settings.group("texture_from",
                 "a picture of tissue whose light, gloss and albedo are estimated, to be used instead of texture, "
                 "light.position_mm, roughness and reflectance",
                 [&look](Settings& s) { describe_texture_source(s, look.texture_from); });
  settings.integer("seed", look.seed, {0, 1e9}, "of the procedural texture and of the noise");
  settings.number("roughness", look.roughness, {0.05, 1}, "of the wet surface; smaller makes sharper highlights");
  settings.number("reflectance", look.reflectance, {0, 1}, "of the wet surface at normal incidence");
  settings.number("exposure", look.exposure, {0, 100, true}, "factor on the brightness");
  settings.group("light", "the light of the scope; brightness falls with the square of the distance",
                 [&look](Settings& s) { describe_light(s, look.light); });
  settings.group("noise", "of the sensor", [&look](Settings& s) { describe_noise(s, look.noise); });
  settings.group("border", "the blurred edge of the scope's view",
                 [&look](Settings& s) { describe_border(s, look.border); });
  settings.group("smoke", "of cautery: contrast is lost, more where it is deeper",
                 [&look](Settings& s) { describe_smoke(s, look.smoke); });
  settings.group("blood", "dark smooth patches that move with the tissue",
                 [&look](Settings& s) { describe_blood(s, look.blood); });
  settings.flag("interlace", look.interlace,
                "odd rows show the scene half a frame later; truth.csv is of the even rows, depth of each row its own");
  settings.after_reading([&look] { settle_word_or_file("simulate.look.texture", look.texture, {"procedural"}); });
}

void describe_pan(Settings& settings, SimulatedPan& pan) {
  settings.vector3("by_mm", pan.by_mm, {-100, 100}, "how far, smoothly from rest to rest; the axes do not turn, mm");
  settings.number("from_s", pan.from_s, {0, 600}, "when it begins, s");
  settings.number("during_s", pan.during_s, {0, 600, true}, "how long it takes, s");
}

void describe_camera(Settings& settings, SimulatedCamera& camera) {
  settings.integer("width", camera.width, {64, 8192}, "of one image, px");
  settings.integer("height", camera.height, {64, 8192}, "of one image, px");
  settings.number("focal_px", camera.focal_px, {10, 100000}, "focal length, px");
  settings.number("baseline_mm", camera.baseline_mm, {1, 200}, "distance between the cameras, mm");
  settings.number("fps", camera.fps, {1, 1000}, "frames per second");
  settings.group("pan", "both cameras move while patient and trocar stand; truth.csv is in the moving camera's frame",
                 [&camera](Settings& s) { describe_pan(s, camera.pan); });
  settings.after_reading([&camera] {
    if (camera.width % 2 != 0 || camera.height % 2 != 0)
      throw BadInput(fmt::format("simulate.camera: the video needs an even width and height, not {} x {}", camera.width,
                                 camera.height));
  });
}

void describe_instrument(Settings& settings, SimulatedInstrument& instrument) {
  using Model = SimulatedInstrument::Model;
  settings.choice("model", instrument.model,
                  {{"grasper", Model::grasper}, {"probe", Model::probe}, {"hook", Model::hook}},
                  "shape of the instrument");
  using Look = SimulatedInstrument::Look;
  settings.choice(
      "look", instrument.look,
      {{"steel", Look::steel},
       {"dark_ribbed", Look::dark_ribbed},
       {"white_ceramic", Look::white_ceramic},
       {"blue_tube", Look::blue_tube}},
      "steel all over; a dark-grey ribbed shaft with a bright wrist and jaws that reflect the tissue's red; "
      "white with a steel end; a bluish-white tube with holes");
  settings.number("blood", instrument.blood, {0, 0.9}, "fraction of it that is smeared with blood");
  settings.number("shaft_mm", instrument.shaft_mm, {1, 20}, "diameter of the shaft, mm");
  settings.vector3("enters_from", instrument.enters_from, {-kLargest_mm, kLargest_mm},
                   "point that the shaft always passes through, left camera frame, mm");
  settings.number("free_distance_mm", instrument.free_distance_mm, {0, kLargest_mm, true},
                  "how far from the contact the tip begins and ends, along the shaft, mm");
}

void describe_breathing(Settings& settings, SimulatedBreathing& breathing) {
  settings.vector3("motion_mm", breathing.motion_mm, {-100, 100},
                   "how far organ and background have moved half a period after the start, left camera frame, mm");
  settings.number("period_s", breathing.period_s, {0.1, 60}, "time of one breath, s");
  using Instrument = SimulatedBreathing::Instrument;
  settings.choice("instrument", breathing.instrument,
                  {{"follows", Instrument::follows}, {"stands", Instrument::stands}},
                  "stands: the hand keeps its own path and meets the tissue where it is at the touch, so that the true "
                  "force breathes; follows: moves of the gesture are measured from the moving tissue, and the force is "
                  "the same without; also where heart or stretch move the tissue");
}

void describe_heart(Settings& settings, SimulatedHeart& heart) {
  settings.vector3("motion_mm", heart.motion_mm, {-100, 100},
                   "how far organ and background have moved half a period after the start, left camera frame, mm");
  settings.number("period_s", heart.period_s, {0.1, 60}, "time of one beat, s");
}

void describe_stretch(Settings& settings, SimulatedStretch& stretch) {
  settings.vector3("strain", stretch.strain, {-0.2, 0.2},
                   "of the attached nodes about simulate.body.center_mm, along x, y, z of the left camera, half a "
                   "period after the start; the tissue between them follows in equilibrium");
  settings.number("period_s", stretch.period_s, {0.1, 60}, "time of there and back, s");
}

void describe_obscured(Settings& settings, SimulatedObscured& obscured) {
  settings.number("from_s", obscured.from_s, {0, 600}, "from this time on, s");
  settings.number("to_s", obscured.to_s, {0, 600}, "until before this time; not after from_s = never, s");
  settings.number("radius_mm", obscured.radius_mm, {0, 100, true}, "radius of the ball of gauze, mm");
}

void describe_gesture_row(Settings& settings, GestureRow& row) {
  settings.number("approach_s", row.approach_s, {0, 60},
                  "come in, free, and touch the tissue at the end of this time, s");
  settings.pixel("at_px", row.at_px, "with approach_s: pixel of the left image at rest where the tissue is touched");
  settings.number("footprint_radius_mm", row.footprint_radius_mm, {0, 50},
                  "with approach_s: radius of the patch that the tip holds, 0 = as contact.footprint_radius_mm, mm");
  settings.flag("grasp", row.grasp, "the contact begins; the tip holds the tissue whatever it does");
  settings.flag("push", row.push,
                "the contact begins; the tip presses and slides (contact.friction), and touches only while it is "
                "below the surface at rest");
  settings.vector3(
      "move_mm", row.move_mm, {-100, 100},
      "with during_s: where the tip goes, measured from where it touched: outward normal n, tangent a (to the "
      "right in the image), tangent b (down), mm");
  settings.number("during_s", row.during_s, {0, 60}, "time of the move, s");
  settings.number("hold_s", row.hold_s, {0, 60}, "stay, s");
  settings.flag("release", row.release, "the contact ends");
  settings.number("leave_s", row.leave_s, {0, 60}, "with release: time in which the instrument goes away, s");
}

void describe_gesture(Settings& settings, std::vector<GestureRow>& gesture, const std::string& doc) {
  settings.list(
      "gesture", doc, [&gesture] { return static_cast<int>(gesture.size()); },
      [&gesture](int count) { gesture.assign(static_cast<size_t>(count), GestureRow{}); },
      [&gesture](Settings& s, int i) { describe_gesture_row(s, gesture[static_cast<size_t>(i)]); });
}

void describe_second(Settings& settings, SimulatedSecond& second) {
  settings.group("instrument", "as simulate.instrument",
                 [&](Settings& s) { describe_instrument(s, second.instrument); });
  describe_gesture(settings, second.gesture,
                   "as simulate.gesture; until it grasps, the instrument follows tissue that the first one moves");
}

void describe_truth(Settings& settings, SimulatedTruth& truth) {
  using Patch = SimulatedTruth::Patch;
  settings.choice("patch", truth.patch,
                  {{"disc", Patch::disc},
                   {"ellipse", Patch::ellipse},
                   {"soft_rim", Patch::soft_rim},
                   {"two_jaws", Patch::two_jaws}},
                  "rigid disc; rigid ellipse 1:2 of the same area; a weighted mean that fades from half the radius to "
                  "1.3 times; two rigid discs side by side that move together");
}

void describe_files(Settings& settings, SimulatedFiles& files) {
  settings.flag("surface", files.surface, "surface/frame_0000.ply ...: the organ in each frame, left camera frame, mm");
  settings.flag("depth", files.depth,
                "depth/left_0000.png ...: what the left camera sees, 16 bit, in hundredths of a millimetre along the "
                "optical axis, 0 = nothing");
  settings.flag("sensor", files.sensor,
                "sensor.csv: what a force sensor logs (100 Hz, its own clock, axes of the tool, an offset, noise); "
                "sensor.yaml: what of it has to be found out");
  settings.choice("grip", files.grip,
                  {{"known", SimulatedFiles::Grip::known}, {"auto", SimulatedFiles::Grip::automatic}},
                  "contact.grip of the scene.yaml that is written: that of the gesture, or left to the estimator");
}

}  // namespace

void describe(Settings& settings, SimulateOptions& options) {
  settings.group("body", "the organ at rest", [&](Settings& s) { describe_body(s, options.body); });
  settings.group("look", "what it looks like", [&](Settings& s) { describe_look(s, options.look); });
  settings.group("camera", "both cameras", [&](Settings& s) { describe_camera(s, options.camera); });
  settings.group("instrument", "what touches the tissue",
                 [&](Settings& s) { describe_instrument(s, options.instrument); });
  settings.group("breathing", "organ and background move by motion_mm (1 - cos(2 pi t / period_s)) / 2",
                 [&](Settings& s) { describe_breathing(s, options.breathing); });
  settings.group("heart", "the same once more, faster, added to breathing",
                 [&](Settings& s) { describe_heart(s, options.heart); });
  settings.group("stretch", "the attachments are strained by strain (1 - cos(2 pi t / period_s)) / 2",
                 [&](Settings& s) { describe_stretch(s, options.stretch); });
  settings.group("obscured", "gauze before the tip, in both images; the tip counts as not visible then",
                 [&](Settings& s) { describe_obscured(s, options.obscured); });
  describe_gesture(
      settings, options.gesture,
      "what the instrument does, row after row, smooth in between; each row has exactly one of approach_s, "
      "grasp, push, during_s, hold_s, release");
  settings.group(
      "second", "another instrument at work at the same time (truth_2.csv); both have to grasp",
      [&](Settings& s) { describe_second(s, options.second); }, &options.second.present);
  settings.group("truth", "what the instrument holds in the truth where it grasps; elements: simulate.body.elements",
                 [&](Settings& s) { describe_truth(s, options.truth); });
  settings.group("write", "what is written besides the recording and its truth",
                 [&](Settings& s) { describe_files(s, options.write); });
  settings.after_reading([&options] {
    check_gesture(options.gesture);
    if (is_push(options.gesture) && options.truth.patch != SimulatedTruth::Patch::disc)
      throw BadInput("simulate.truth.patch: a tip that pushes has a disc, and the gesture pushes");
    if (!options.second.present) return;
    check_gesture(options.second.gesture);
    if (is_push(options.gesture) || is_push(options.second.gesture))
      throw BadInput("simulate.second: two instruments have to grasp, and one of the gestures pushes");
  });
}

}  // namespace palpate
