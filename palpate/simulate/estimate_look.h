#pragma once

#include "palpate/simulate/simulate_options.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// How a picture of tissue was lit and what it shows without that light.
struct EstimatedLook {
  Vec3 light_mm = Vec3::Zero();  ///< place of the light, left camera frame
  double roughness = 0.36;
  double reflectance = 0.04;   ///< at normal incidence
  double shading_scatter = 0;  ///< deviation of log(image / shading): what the albedo varies by
  cv::Mat albedo;        ///< CV_32FC3, linear BGR, size of the image; filled in under highlights and beyond `seen`
  cv::Mat seen;          ///< 255 where the picture shows the surface
  double mm_per_px = 0;  ///< of the albedo at the surface's median depth
};

/// Light position, diffuse reflectance, specular strength and roughness from one left image, as section VII.B of the
/// paper asks for: a point light whose shading cos / d^2 explains the image best (robustly, over places of equal
/// albedo on average), then the lobe that explains what is grey on top of it; both divided out. The product of light
/// and albedo is one unknown: exposure and light.reference_mm of `look` are taken for the light's strength, X `surface`
/// in mm, left camera frame. Throws BadInput when too little of it is seen.
EstimatedLook estimate_look(const cv::Mat& left_bgr, const Camera& left_camera, const Surface& surface,
                            const SimulatedLook& look);

}  // namespace palpate
