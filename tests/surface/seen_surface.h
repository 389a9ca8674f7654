#pragma once

#include <functional>
#include <string>

#include "palpate/core/geometry.h"

namespace palpate::test {

/// A surface known in closed form (zero of `value`, negative inside) that a camera at the origin looks at.
struct TrueSurface {
  std::string name;
  std::function<double(const Vec3&)> value;

  /// First-order distance |f| / |grad f|.
  double distance_mm(const Vec3& p) const;
  /// Unit vector out of the body.
  Vec3 normal(const Vec3& p) const;
};

TrueSurface sphere_cap();   ///< radius 30 mm, middle at 110 mm
TrueSurface saddle();       ///< z = 100 + (x^2 - y^2) / 80
TrueSurface torus_patch();  ///< radii 30 and 12 mm, lying before the camera
TrueSurface bumpy_organ();  ///< ellipsoid of 60 mm with waves of 14 mm length and 0.8 mm height

TrueSurface ball_before_wall();  ///< radius 18 mm at 85 mm, wall at 125 mm

struct View {
  double focal_px = 700;
  int half_width_px = 200;
  int half_height_px = 180;
  int step_px = 1;
  double noise_mm = 0;       ///< along the ray
  double outlier_share = 0;  ///< uniform within 20 mm along the ray
  Vec3 hole_center_mm = Vec3::Zero();
  double hole_radius_mm = 0;  ///< points this near to `hole_center_mm` are missing
  int ramp_px = 0;            ///< depth edges are smeared over so many pixels, as windows that straddle them do
  unsigned seed = 1;
};

/// One point per pixel that sees the surface, as dense stereo gives them.
PointCloud look_at(const TrueSurface& surface, const View& view);

double rms_distance_mm(const TrueSurface& truth, const std::vector<Vec3>& points);

/// What is wrong with the topology of S* ("" = edge-manifold, consistently oriented, one component).
std::string topology_fault(const Surface& surface);

int boundary_loops(const Surface& surface);

/// Share of triangles whose normal looks away from the camera.
double fraction_facing_away(const Surface& surface);

}  // namespace palpate::test
