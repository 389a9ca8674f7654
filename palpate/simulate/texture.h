#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>

#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// What a point of a surface looks like.
struct Texel {
  Eigen::Vector3f albedo = Eigen::Vector3f::Constant(0.5f);  ///< linear red, green, blue, 0..1
  Eigen::Vector3f slope = Eigen::Vector3f::Zero();           ///< gradient of the height of small bumps, mm / mm
};

/// Texel at a point of the surface at rest (mm) with its outward normal there.
using Texture = std::function<Texel(const Vec3& rest_mm, const Vec3& normal)>;

/// Organ: mottled red tissue with vessels, a little fat and fine grain, or the image that the options name, laid on
/// from three sides. Throws BadInput when the image cannot be read.
Texture tissue_texture(const SimulatedLook& look);

/// Tissue with the albedo of a linear BGR image (CV_32FC3) laid on from three sides, and the relief of the procedural
/// one.
Texture image_texture(const cv::Mat& linear_bgr, double mm_per_px, int seed);

/// The same with patches of blood: dark, with less relief, their fraction of space as told.
Texture bloody(const Texture& clean, const SimulatedBlood& blood, int seed);

/// The wall of the cavity behind the organ: darker, browner, fat and vessels.
Texture wall_texture(int seed);

/// White cloth, woven.
Texture gauze_texture();

/// Brushed steel.
Texture steel_texture();

}  // namespace palpate
