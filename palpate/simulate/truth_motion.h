#pragma once

#include <functional>
#include <vector>

#include "palpate/elastic/material.h"
#include "palpate/simulate/dejavu_files.h"
#include "palpate/simulate/instrument_shape.h"
#include "palpate/simulate/simulate_options.h"
#include "palpate/simulate/truth_body.h"

namespace palpate {

/// Where and how the tissue is touched, at rest. Columns of `axes`: outward normal, tangents to the right and down.
struct TouchPoint {
  Vec3 point_mm;
  Mat3 axes;
};

/// The point of the organ that the left camera sees at `at_px`. Throws BadInput when it sees none there.
TouchPoint find_touch_point(const Surface& organ, const SimulatedCamera& camera, cv::Point2d at_px);

/// Everything that is known at one moment before a picture is drawn.
struct Moment {
  TruthRow truth;
  InstrumentPlace place;
  Vec3 scene_mm = Vec3::Zero();  ///< by which organ and background are displaced, left camera frame of this moment
  TruthRow second_truth;         ///< of a second instrument, where there is one
  InstrumentPlace second_place;
  Eigen::VectorXd u;  ///< of the true nodes, mm, without scene_mm; empty = at rest
};

/// What the equilibria of a sequence have in common.
struct MotionQuality {
  double largest_residual = 0;
  double smallest_volume_ratio = 1;
};

/// Length of the longer gesture, s.
double motion_duration_s(const SimulateOptions& options);

/// The moments of `frames` frames, or of twice as many fields when the pictures are interlaced (field 2 k belongs to
/// frame k, field 2 k + 1 is half a frame later). `touches`: one for each instrument. `friction` is that of a push.
/// Everything is in the frame of the left camera of that moment. Where the tissue moves by itself beneath a hand that
/// stands, the tip touches it where it is at that time, and what the tissue has moved since then loads it; a tip that
/// has let go and is still below the surface presses until it has left. `step` is called after every moment. Throws
/// BadInput when the tissue finds no equilibrium.
std::vector<Moment> solve_motion(const SimulateOptions& options, const TissueOptions& tissue, const TruthBody& truth,
                                 const std::vector<TouchPoint>& touches, double friction, int frames,
                                 MotionQuality& quality, const std::function<void()>& step);

/// Pixel of an camera at (eye_x_mm, 0, 0), parallel to the left one, without distortion.
cv::Point2d project(const SimulatedCamera& camera, const Vec3& point_mm, double camera_x_mm);

}  // namespace palpate
