#include "palpate/infer/inference_parameters.h"

namespace palpate {

void describe(Settings& settings, InferenceParameters& p) {
  const Range positive{0, 1e6, true, false}, probability{0, 1, true, true};
  settings.number("point_px", p.point_px, positive, "deviation of a tracked point in one camera");
  settings.number("point_dof", p.point_dof, positive, "Student-t degrees of freedom of a point");
  settings.number("effective_points", p.effective_points, positive, "effective sample size of a frame's points");
  settings.number("motion_error", p.motion_error, {0, 10},
                  "error of the model's motion of a point, ratio to a half-space's (displacement x radius / distance)");
  settings.number("tip_floor_mm", p.tip_floor_mm, positive, "min. deviation of the tip's displacement");
  settings.number("tip_disparity_px", p.tip_disparity_px, positive, "the same along the viewing ray, of the disparity");
  settings.number("tip_dof", p.tip_dof, positive, "Student-t degrees of freedom of the tip");
  settings.number("excluded_radii", p.excluded_radii, positive, "points nearer to a patch are left out");
  settings.number("scene_mm", p.scene_mm, positive, "prior of the scene's translation");
  settings.number("scene_rad", p.scene_rad, positive, "prior of the scene's rotation");
  settings.number("scene_walk_mm", p.scene_walk_mm, positive, "random walk of the translation, mm per sqrt(s)");
  settings.number("scene_walk_rad", p.scene_walk_rad, positive, "random walk of the rotation, rad per sqrt(s)");
  settings.number("scene_strain", p.scene_strain, positive, "prior of the scene's homogeneous strain");
  settings.number("scene_walk_strain", p.scene_walk_strain, positive, "random walk of the strain, per sqrt(s)");
  settings.number("disparity_bias_px", p.disparity_bias_px, positive, "prior of the disparity's common bias");
  settings.number("hand_mm_per_s", p.hand_mm_per_s, positive, "speed of a hand");
  settings.number("log_radius", p.log_radius, positive, "prior of the log of the footprint radius");
  settings.number("min_radius_ratio", p.min_radius_ratio, probability, "smallest radius over the stated one");
  settings.number("max_radius_ratio", p.max_radius_ratio, {1, 100}, "largest radius over the stated one");
  settings.number("offset_mm", p.offset_mm, positive, "prior of measured tip minus middle of the patch, each axis");
  settings.number("touch_mm", p.touch_mm, positive, "displacement of the patch in the frame of onset");
  settings.number("stated_radius", p.stated_radius, positive, "the same where the stated radius is right");
  settings.number("stated_right", p.stated_right, probability, "probability that the stated radius is right");
  settings.number("skew", p.skew, positive,
                  "prior of the common error of the model's motion of all tissue, ratio to it");
  settings.number("tissue_radius", p.tissue_radius, positive, "error of the log radius that the tissue tells");
  settings.number("offset_walk_mm", p.offset_walk_mm, {0, 100}, "random walk of the offset, mm per sqrt(s)");
  settings.number("log_radius_walk", p.log_radius_walk, {0, 100}, "random walk of the log radius per sqrt(s)");
  settings.number("telling_force", p.telling_force, {0, 1000}, "the radius is learned at so many deviations of force");
  settings.number("radius_change", p.radius_change, {0, 1},
                  "ratio by which the radius told differs from the one of the patch before it is laid anew");
  settings.number("laid_anew", p.laid_anew, {0, 100},
                  "so often in a row before radius and offset are learned all the same");
  settings.number("as_good", p.as_good, {0, 100}, "a difference of log evidence that says nothing");
  settings.number("may_slide", p.may_slide, {0, 1}, "probability of a slide from which on the radius is kept");
  settings.number("slide_reach_radii", p.slide_reach_radii, {0, 10},
                  "a slid patch is laid anew so many radii from its place");
  settings.number("new_pose", p.new_pose, {0, 10},
                  "change of the patch's displacement, ratio to it, before radius and offset are learned again");
  settings.number("touch_per_s", p.touch_per_s, positive, "rate at which a free tip begins to touch");
  settings.number("release_per_s", p.release_per_s, positive, "rate at which a tip releases the tissue");
  settings.number("slip_per_s", p.slip_per_s, positive, "rate at which a push begins to slide");
  settings.number("stick_per_s", p.stick_per_s, positive, "rate at which a slide ends");
  settings.number("free_space_mm", p.free_space_mm, positive, "a free tip is anywhere within so much of the surface");
  settings.number("gap_mm", p.gap_mm, positive, "surface against tip where they touch");
  settings.number("resting_mm_per_s", p.resting_mm_per_s, positive, "speed of a tip that has touched");
  settings.number("unnoticed", p.unnoticed, probability, "probability that a touch begins unnoticed");
  settings.number("inside_mm", p.inside_mm, positive, "how deep such a tip may be");
  settings.number("remembered_s", p.remembered_s, positive, "how long a touch that may have gone by is kept in mind");
  settings.number("look_back_s", p.look_back_s, positive, "between two looks whether one has gone by");
  settings.number("look_back_points", p.look_back_points, positive,
                  "points nearest to where it may have been that tell whether it has");
  settings.number("look_back_radii", p.look_back_radii, positive, "how near they are, in stated radii");
  settings.number("look_back_ratio", p.look_back_ratio, probability,
                  "where, by this ratio, more of them than of all others are not explained");
  settings.number("unconfirmed", p.unconfirmed, probability,
                  "max. probability of such a touch until the next frame's tissue confirms it");
  settings.number("told_log_odds", p.told_log_odds, positive, "log odds of what the jaws are seen to do");
  settings.number("held_untold", p.held_untold, probability, "probability that contact.at_px is held already");
  settings.number("hold_again_per_s", p.hold_again_per_s, positive, "rate at which a tip holds its last place again");
  settings.number("left_mm", p.left_mm, positive, "as far from its place, or from the surface, a tip has left it");
  settings.number("friction_error", p.friction_error, positive, "deviation of the friction coefficient, ratio to it");
  settings.number("even_points", p.even_points, {1, 10000}, "points followed all over the organ");
  settings.number("near_points", p.near_points, {0, 10000}, "points followed around each contact");
  settings.number("settling_s", p.settling_s, {0, 10}, "time after onset in which tissue tells where the tip stands");
  settings.number("unexplained_deviations", p.unexplained_deviations, positive,
                  "a point farther from its prediction is not explained");
  settings.number("unexplained_ratio", p.unexplained_ratio, probability,
                  "more of the points than this unexplained: map_stale");
  settings.number("min_points_obscured", p.min_points_obscured, probability,
                  "fraction of the points below which an obscured picture shows nothing");
  settings.number("min_points", p.min_points, probability,
                  "fraction of the points below which a clear picture shows another scene");
  settings.number("telling_deviation", p.telling_deviation, positive,
                  "a hidden tip's force is told where its deviation is below this ratio of it");
  settings.number("model_error", p.model_error, {0, 10}, "of the force, ratio to it: what the model's form leaves");
}

}  // namespace palpate
