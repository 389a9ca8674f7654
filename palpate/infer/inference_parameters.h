#pragma once

#include "palpate/core/settings.h"

namespace palpate {

/// Every number that the inference decides by (docs/inference.md says where each comes from).
struct InferenceParameters {
  // What is measured, and how well.
  double point_px = 0.07;        ///< deviation of a tracked point in one camera, px
  double point_dof = 4;          ///< Student-t degrees of freedom of a point
  double effective_points = 25;  ///< effective sample size: more points share their errors with neighbours
  double motion_error = 0.15;    ///< error of the model's motion of a point, ratio to a half-space's: |q| r / distance
  double tip_floor_mm = 0.05;    ///< least deviation of the tip's displacement
  double tip_disparity_px = 0.03;  ///< the same along the viewing ray: deviation of the tip's disparity
  double tip_dof = 6;              ///< Student-t degrees of freedom of the tip
  double excluded_radii = 1;       ///< points nearer to a patch than so many of its radii are left out

  // What is not known beforehand: one standard deviation.
  double scene_mm = 15, scene_rad = 0.1;                  ///< rigid motion of the scene since the map
  double scene_walk_mm = 15, scene_walk_rad = 0.1;        ///< the same, per square root of a second
  double scene_strain = 0.01, scene_walk_strain = 0.003;  ///< homogeneous strain of the scene, and its walk
  double disparity_bias_px = 0.05;                        ///< common to all points of a frame
  double hand_mm_per_s = 40;                              ///< speed of a hand: walk of the patch, and of a free tip
  double log_radius = 0.7;                                ///< of the patch's radius: a factor of two
  double stated_radius = 0.07;                            ///< the same where the stated one is right
  double stated_right = 0.5;                              ///< probability that it is
  double tissue_radius = 0.12;  ///< of the log radius that the tissue tells: the model's error far from the patch
  double min_radius_ratio = 0.4, max_radius_ratio = 3;  ///< radii allowed, over the stated one
  double offset_mm = 0.4;                               ///< measured tip minus middle of the patch, each axis
  double touch_mm = 0.1;                                ///< displacement of the patch in the frame of onset
  double skew = 0.03;                                   ///< common error of the model's motion of all tissue, ratio
  double offset_walk_mm = 0.05, log_radius_walk = 0.1;  ///< the same, per square root of a second
  double telling_force = 3;                             ///< the radius is learned where the force is so many deviations
  double radius_change = 0.08;     ///< ratio by which the radius told differs from the one laid before it is laid anew
  double laid_anew = 4;            ///< so often in a row before the slow unknowns are learned all the same
  double as_good = 1;              ///< a difference of log evidence that says nothing
  double may_slide = 0.05;         ///< probability of a slide from which on the radius is kept
  double slide_reach_radii = 0.4;  ///< a slid patch is laid anew so many radii from its place
  double new_pose = 0.1;           ///< ratio of itself by which q changes before the slow unknowns are learned again

  // What holds the tissue: rates in 1/s, densities of a tip that begins to touch.
  double touch_per_s = 0.5;    ///< a free tip begins to touch
  double release_per_s = 0.3;  ///< a tip lets go
  double slip_per_s = 2, stick_per_s = 2;
  double free_space_mm = 30;      ///< a free tip is anywhere within so much of the surface
  double gap_mm = 0.35;           ///< surface against tip where they touch: bias of both depths
  double resting_mm_per_s = 2.5;  ///< speed of a tip that has touched, against the tissue
  double unnoticed = 0.05;        ///< probability that a touch begins unnoticed, anywhere inside
  double inside_mm = 10;          ///< how deep such a tip may be
  double remembered_s = 2;        ///< how long a touch that may have gone by unnoticed is kept in mind
  double look_back_s = 0.2;       ///< between two looks whether it has
  double look_back_points = 8;    ///< so many points of the tissue nearest to its place; half of them are enough
  double look_back_radii = 4;     ///< as near to it as so many stated radii
  double look_back_ratio = 0.35;  ///< of its nearest points, where more than elsewhere are not explained
  double unconfirmed = 0.4;       ///< max. probability of such a touch, until the next frame's tissue confirms it
  double told_log_odds = 10;      ///< of what the jaws are seen to do: closing they touch, closed they are not free
  double held_untold = 0.02;      ///< probability that the place that the operator names is held already
  double hold_again_per_s = 10;   ///< a tip that looks free holds its place again
  double left_mm = 2;             ///< as far from its place, or from the surface, a tip has left it
  double friction_error = 0.5;    ///< deviation of the friction coefficient, ratio to it

  // Which tissue is followed, and when it is not explained.
  double even_points = 110, near_points = 90;  ///< points followed all over the organ, and around each contact
  double settling_s = 0.15;                    ///< after onset the tip's place against the patch is told by the tissue
  double unexplained_deviations = 6;           ///< a point farther from its prediction is not explained
  double unexplained_ratio = 0.6;              ///< more of them than this: no hypothesis explains the frame

  double min_points_obscured = 0.6;  ///< fraction of the points below which an obscured picture shows nothing
  double min_points = 0.25;          ///< and a clear one another scene
  double telling_deviation = 0.4;    ///< a hidden tip's force is told where its deviation is below this ratio of it

  // The band.
  double model_error = 0.03;  ///< of the force, ratio to it: what the model's form leaves
};

void describe(Settings& settings, InferenceParameters& parameters);

}  // namespace palpate
