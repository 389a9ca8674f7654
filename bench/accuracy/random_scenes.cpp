#include "bench/accuracy/random_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "palpate/simulate/gesture.h"
#include "palpate/simulate/organ_shape.h"

namespace palpate {
namespace {

constexpr int kElements = 4000;        // of the truth
constexpr int kPushedElements = 8000;  // a disc that slides needs finer ones
constexpr int kFiner = 4;              // times as many, where the truth is not the model
constexpr int kMapElements = 1344;

enum class Act { pull, press, drag, push, slide };  // the first three grasp

// Uniform draws that are the same with every standard library.
class Dice {
 public:
  Dice(int number, int attempt) : bits_(static_cast<uint64_t>(1000 * attempt + number)) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(bits_() >> 11) * 0x1.0p-53;
  }
  double on_a_log_scale(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  int below(int count) { return static_cast<int>(between(0, count)); }
  bool chance(double probability) { return between(0, 1) < probability; }
  double sign() { return chance(0.5) ? 1 : -1; }

 private:
  std::mt19937_64 bits_;
};

SimulatedBody draw_body(Dice& dice) {
  SimulatedBody body;
  switch (dice.below(3)) {
    case 0:
      body.shape = "pear";
      body.size_mm = {dice.between(54, 74), dice.between(44, 56), dice.between(36, 46)};
      body.rotation_deg = {dice.between(-20, 20), dice.between(-15, 15), dice.between(-40, 40)};
      break;
    case 1:
      body.shape = "slab";
      body.size_mm = {dice.between(80, 100), dice.between(60, 78), dice.between(18, 30)};
      body.rotation_deg = {dice.between(-20, 10), dice.between(-12, 12), dice.between(-15, 15)};
      break;
    default:
      body.shape = "heart";
      body.size_mm = {dice.between(62, 76), dice.between(52, 64), dice.between(38, 48)};
      body.rotation_deg = {dice.between(-10, 10), dice.between(-15, 15), dice.between(-40, 40)};
  }
  body.center_mm = {dice.between(-6, 6), dice.between(-4, 6), dice.between(98, 114)};
  return body;
}

TissueOptions draw_tissue(Dice& dice, Act act) {
  TissueOptions tissue;
  // Saint Venant-Kirchhoff has no stable answer to a deep push.
  const double kind = dice.between(0, 1);
  tissue.law = kind < 0.6                       ? Law::neo_hookean
               : kind < 0.8 && act == Act::pull ? Law::saint_venant_kirchhoff
                                                : Law::corotated;
  tissue.young_modulus_kPa = dice.on_a_log_scale(5, 400);
  tissue.poisson_ratio = dice.between(0.3, 0.46);
  return tissue;
}

GestureRow move(const Vec3& to_mm, double during_s) {
  GestureRow row;
  row.move_mm = to_mm;
  row.during_s = during_s;
  return row;
}

GestureRow hold(double seconds) {
  GestureRow row;
  row.hold_s = seconds;
  return row;
}

// 2.8 to 3.5 s.
std::vector<GestureRow> draw_gesture(Dice& dice, Act act, const SimulatedBody& body, const SimulatedCamera& camera) {
  GestureRow approach, contact, release;
  approach.approach_s = dice.between(0.5, 0.6);
  approach.footprint_radius_mm = dice.between(2.5, act == Act::push || act == Act::slide ? 5 : 4.5);
  const Vec3 aside_mm(0.2 * body.size_mm.x() * dice.between(-1, 1), 0.2 * body.size_mm.y() * dice.between(-1, 1), 0);
  const Vec3 at_mm = body.center_mm + left_from_body(body) * aside_mm;
  approach.at_px = {std::round(camera.focal_px * at_mm.x() / at_mm.z() + 0.5 * (camera.width - 1)),
                    std::round(camera.focal_px * at_mm.y() / at_mm.z() + 0.5 * (camera.height - 1))};
  contact.push = act == Act::push || act == Act::slide;
  contact.grasp = !contact.push;
  release.release = true;
  release.leave_s = 0.4;
  // No deeper than a seventh of the organ, and 0.8 of the patch.
  const double thickness_mm = body.size_mm.minCoeff(), radius_mm = approach.footprint_radius_mm;
  const double depth_mm = dice.between(0.5, 1) * std::min({3.0, thickness_mm / 7, 0.8 * radius_mm});
  const double angle = dice.between(0, 6.283185307179586);
  const auto sideways = [&](double n_mm, double along_mm) {
    return Vec3(n_mm, along_mm * std::cos(angle), along_mm * std::sin(angle));
  };
  std::vector<GestureRow> rows = {approach, contact};
  const auto then = [&rows](std::initializer_list<GestureRow> more) { rows.insert(rows.end(), more); };
  const double slow_s = dice.between(0.5, 0.65);
  switch (act) {
    case Act::pull: {
      const double pull_mm = dice.between(1.5, 4);
      then({move(sideways(pull_mm, dice.between(0, 1)), slow_s), hold(0.24), move(sideways(0.4 * pull_mm, 0), 0.4),
            hold(0.12), move(Vec3::Zero(), 0.44)});
      break;
    }
    case Act::press:
      then({move(sideways(-depth_mm, dice.between(0, 0.5)), slow_s), hold(0.24),
            move(sideways(-0.3 * depth_mm, 0), 0.4), hold(0.12), move(Vec3::Zero(), 0.44)});
      break;
    case Act::drag: {
      const double drag_mm = dice.between(1.5, 4);
      then({move(sideways(0, drag_mm), slow_s), hold(0.2), move(sideways(dice.between(-0.5, 1), -0.5 * drag_mm), 0.5),
            hold(0.12), move(Vec3::Zero(), 0.44)});
      break;
    }
    case Act::push:
      then({move(sideways(-depth_mm, 0), slow_s), hold(0.24), move(sideways(-0.4 * depth_mm, 0), 0.4), hold(0.12),
            move(sideways(0.5, 0), 0.4)});
      break;
    case Act::slide: {
      const double slide_mm = dice.between(4, 8);
      then({move(sideways(-depth_mm, 0), slow_s), hold(0.16), move(sideways(-depth_mm, slide_mm), 0.8), hold(0.12),
            move(sideways(0.5, slide_mm), 0.4)});
    }
  }
  then({release, hold(0.1)});
  return rows;
}

void draw_motion(Dice& dice, SimulateOptions& simulate) {
  const bool moves = dice.chance(0.5), beats = dice.chance(0.5);
  Vec3 direction(0.3 * dice.between(-1, 1), dice.between(0.3, 1), dice.between(-1, 1));
  direction.normalize();
  simulate.breathing.period_s = dice.between(3, 5);
  simulate.heart.period_s = dice.between(0.7, 1);
  const double breath_mm = dice.between(0.5, beats ? 2.2 : 3), beat_mm = dice.between(0.2, 0.8);
  const Vec3 beat = Vec3(dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1)).normalized();
  if (!moves) return;
  simulate.breathing.motion_mm = breath_mm * direction;
  if (beats) simulate.heart.motion_mm = beat_mm * beat;
}

SimulatedLook draw_look(Dice& dice) {
  SimulatedLook look;
  look.seed = 1 + dice.below(100000);
  look.roughness = dice.between(0.3, 0.45);
  look.exposure = dice.between(0.75, 1);
  look.noise = {dice.between(0.4, 1.2), dice.between(0.8, 2)};
  return look;
}

}  // namespace

SceneFile random_scene(int number, int attempt) {
  Dice dice(number, attempt);
  SceneFile scene_file;
  scene_file.file = fmt::format("random_{:02d}.yaml", number);
  scene_file.has_simulate = true;
  SimulateOptions& simulate = scene_file.simulate;
  Scene& scene = scene_file.scene;
  const bool other_truth = number % 3 == 0;
  const std::array<Act, 8> acts = {Act::pull, Act::press, Act::drag, Act::pull,
                                   Act::push, Act::slide, Act::push, Act::slide};
  const Act act = acts[static_cast<size_t>(dice.below(other_truth ? 4 : 8))];
  const bool pushes = act == Act::push || act == Act::slide;
  simulate.body = draw_body(dice);
  simulate.body.elements = (pushes ? kPushedElements : kElements) * (other_truth ? kFiner : 1);
  scene.tissue = draw_tissue(dice, act);
  simulate.gesture = draw_gesture(dice, act, simulate.body, simulate.camera);
  draw_motion(dice, simulate);
  simulate.look = draw_look(dice);
  simulate.instrument.model = pushes
                                  ? SimulatedInstrument::Model::probe
                                  : std::array{SimulatedInstrument::Model::grasper, SimulatedInstrument::Model::grasper,
                                               SimulatedInstrument::Model::hook}[static_cast<size_t>(dice.below(3))];
  simulate.instrument.enters_from = {dice.sign() * dice.between(105, 135), dice.between(10, 60), dice.between(10, 30)};
  simulate.instrument.shaft_mm = dice.between(5, 8);
  simulate.write.grip = pushes || dice.chance(0.5) ? SimulatedFiles::Grip::automatic : SimulatedFiles::Grip::known;
  const SimulatedTruth::Patch others[] = {SimulatedTruth::Patch::ellipse, SimulatedTruth::Patch::soft_rim,
                                          SimulatedTruth::Patch::two_jaws};
  if (other_truth) simulate.truth.patch = others[number / 3 % 3];
  AttachmentRegion underside;
  underside.depth_mm = dice.between(5, 8);
  scene.attachments.regions = {underside};
  scene.contact.friction = pushes ? dice.between(0.15, 0.4) : scene.contact.friction;
  scene.map.elements = kMapElements;
  return scene_file;
}

std::string describe_random_scene(const SceneFile& scene_file) {
  const SimulateOptions& simulate = scene_file.simulate;
  const std::vector<GestureRow>& rows = simulate.gesture;
  const bool push = is_push(rows);
  double deepest = 0, highest = 0;
  for (const GestureRow& row : rows) {
    deepest = std::min(deepest, row.move_mm.x());
    highest = std::max(highest, row.move_mm.x());
  }
  const double drag_mm = longest_drag_mm(rows);
  const char* act = push ? (drag_mm > 2 ? "slide" : "push") : drag_mm > 1.2 ? "drag" : highest > 0 ? "pull" : "press";
  const char* const patches[] = {"disc", "ellipse", "soft rim", "two jaws"};
  return fmt::format("{}, {}, {:.0f} kPa, {:.1f} mm {}, {}, moves {:.1f} + {:.1f} mm", simulate.body.shape.string(),
                     law_name(scene_file.scene.tissue.law), scene_file.scene.tissue.young_modulus_kPa,
                     approach_row(rows).footprint_radius_mm, patches[static_cast<int>(simulate.truth.patch)], act,
                     simulate.breathing.motion_mm.norm(), simulate.heart.motion_mm.norm());
}

}  // namespace palpate
