#pragma once

#include <filesystem>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

/// `simulate.body`: the organ at rest, left camera frame.
struct SimulatedBody {
  std::filesystem::path shape = "pear";  ///< pear, slab, heart or a file that read_body opens (already in place)
  Vec3 size_mm = Vec3(62, 48, 44);       ///< of the shape's box before it is turned; x is the long axis
  Vec3 center_mm = Vec3(0, 0, 110);
  Vec3 rotation_deg = Vec3::Zero();  ///< about x, then y, then z of the camera
  int elements = 4000;               ///< tetrahedra of the truth, before it is refined at the contact
};

struct SimulatedLight {
  Vec3 position_mm = Vec3(-5, -7, 0);  ///< from the middle between the cameras
  double radius_mm = 1.5;              ///< of the disc that shines; softens shadows
  double reference_mm = 105;           ///< a white surface at this distance, facing the light, is just white
};

struct SimulatedNoise {
  double read_levels = 0.7;  ///< standard deviation in the dark, of 255 levels
  double shot_levels = 1.2;  ///< additional standard deviation at white; its variance grows with the level
};

/// A picture of real tissue, with the surface that it shows, to take the look from; empty = none.
struct TextureSource {
  std::filesystem::path image;        ///< left image as recorded
  std::filesystem::path surface;      ///< what it shows, left camera frame, mm
  std::filesystem::path calibration;  ///< as recording.calibration
};

/// Edge of the scope's round field of view, in the middle of the image.
struct SimulatedBorder {
  double radius_px = 0;  ///< 0 = the whole image is seen
  double blur_px = 24;   ///< width of the edge
};

struct SimulatedSmoke {
  double density = 0;  ///< optical depth of 100 mm; 0 = none
  double wisps = 0.5;  ///< how uneven it is, 0 = even
};

struct SimulatedBlood {
  double covered = 0;    ///< fraction of the organ
  double patch_mm = 10;  ///< size of a patch
};

/// `simulate.look`.
struct SimulatedLook {
  std::filesystem::path texture = "procedural";  ///< procedural, or an image laid on from three sides
  double texture_mm_per_px = 0.12;               ///< size of a pixel of that image on the tissue
  TextureSource texture_from;                    ///< replaces texture, light.position_mm, roughness and reflectance
  int seed = 1;
  double roughness = 0.36;    ///< of the wet surface
  double reflectance = 0.04;  ///< of the wet surface at normal incidence
  double exposure = 0.85;
  SimulatedLight light;
  SimulatedNoise noise;
  SimulatedBorder border;
  SimulatedSmoke smoke;
  SimulatedBlood blood;
  bool interlace = false;  ///< odd rows are half a frame later
};

/// `simulate.camera.pan`: patient and trocar stand, both cameras move, smoothly from rest to rest.
struct SimulatedPan {
  Vec3 by_mm = Vec3::Zero();  ///< axes of the left camera, which do not turn
  double from_s = 0;
  double during_s = 2;
};

/// `simulate.camera`: both cameras alike, parallel, no distortion, principal point in the middle of the image.
struct SimulatedCamera {
  int width = 960;
  int height = 540;
  double focal_px = 700;
  double baseline_mm = 5;
  double fps = 25;
  SimulatedPan pan = {};
};

/// `simulate.instrument`.
struct SimulatedInstrument {
  enum class Model { grasper, probe, hook } model = Model::grasper;
  enum class Look { steel, dark_ribbed, white_ceramic, blue_tube } look = Look::steel;
  double blood = 0;                      ///< fraction of it that is smeared
  double shaft_mm = 6.4;                 ///< diameter
  Vec3 enters_from = Vec3(130, 25, 20);  ///< the shaft always passes through this point
  double free_distance_mm = 48;          ///< how far from the contact the tip begins and ends, along the shaft
};

/// One row of `simulate.gesture`: exactly one of approach_s, grasp, push, during_s, hold_s, release.
struct GestureRow {
  double approach_s = 0;
  cv::Point2d at_px;
  double footprint_radius_mm = 0;  ///< 0 = as contact.footprint_radius_mm
  bool grasp = false;
  bool push = false;
  Vec3 move_mm = Vec3::Zero();
  double during_s = 0;
  double hold_s = 0;
  bool release = false;
  double leave_s = 0;
};

/// `simulate.second`: another instrument at work at the same time. Both hold what they touch.
struct SimulatedSecond {
  bool present = false;
  SimulatedInstrument instrument;
  std::vector<GestureRow> gesture;
};

/// `simulate.breathing`: organ and what lies behind it go there and back.
struct SimulatedBreathing {
  Vec3 motion_mm = Vec3::Zero();  ///< from expired (where the sequence begins) to inspired, left camera frame
  double period_s = 4;
  /// Whether the hand goes with the tissue or keeps its own path; also where heart or stretch move the tissue.
  enum class Instrument { follows, stands } instrument = Instrument::stands;
};

/// `simulate.heart`: a second motion like breathing, added to it.
struct SimulatedHeart {
  Vec3 motion_mm = Vec3::Zero();
  double period_s = 0.83;
};

/// `simulate.stretch`: the attachments follow an affine motion about the middle of the body, there and back.
struct SimulatedStretch {
  Vec3 strain = Vec3::Zero();  ///< along x, y, z of the left camera, half a period after the start
  double period_s = 4;
};

/// `simulate.obscured`: gauze before the tip, in both images, at from_s <= time < to_s.
struct SimulatedObscured {
  double from_s = 0;
  double to_s = 0;       ///< not after from_s = never
  double radius_mm = 8;  ///< of the ball
};

/// `simulate.truth`: where the true contact is not the estimator's rigid disc; of a grasp.
struct SimulatedTruth {
  enum class Patch { disc, ellipse, soft_rim, two_jaws } patch = Patch::disc;
};

/// `simulate.write`: what is written besides the recording and its truth.
struct SimulatedFiles {
  bool surface = false;  ///< surface/frame_0000.ply ...: the organ as it is in each frame
  bool depth = false;    ///< depth/left_0000.png ...: 16 bit, hundredths of a millimetre, 0 = nothing
  bool sensor = false;   ///< sensor.csv and sensor.yaml: the log of a force sensor, see force_sensor.h
  enum class Grip { known, automatic } grip = Grip::known;  ///< what scene.yaml says to the estimator
};

/// `simulate` of the scene file.
struct SimulateOptions {
  SimulatedBody body;
  SimulatedLook look;
  SimulatedCamera camera;
  SimulatedInstrument instrument;
  SimulatedBreathing breathing;
  SimulatedHeart heart;
  SimulatedStretch stretch;
  SimulatedObscured obscured;
  std::vector<GestureRow> gesture;
  SimulatedSecond second;
  SimulatedTruth truth;
  SimulatedFiles write;
};

/// Keys of the group `simulate`.
void describe(Settings& settings, SimulateOptions& options);

}  // namespace palpate
