#pragma once

#include <Eigen/Core>
#include <array>

#include "palpate/core/geometry.h"
#include "palpate/instrument/find_tip.h"
#include "palpate/instrument/segment.h"

namespace palpate {

/// Part of one camera's image, smoothed, ready to be aligned: brightness follows the texture inside the instrument, and
/// metalness its outline, whatever the background does behind it. Three pyramid levels; float, grey levels 0..255.
struct ImageLayers {
  static constexpr int kLevels = 3;
  cv::Rect region;  ///< of the full image
  std::array<cv::Mat, kLevels> brightness;
  std::array<cv::Mat, kLevels> metal;
};

ImageLayers make_layers(const cv::Mat& bgr, const cv::Rect& region, const SegmentationModel& model);

/// The same where a mask tells what is metal.
ImageLayers make_layers(const cv::Mat& bgr, const cv::Rect& region, const cv::Mat& mask);

/// One pixel of a template, relative to the centre of its cell, px of the full image.
struct CellSample {
  float dx, dy;
  float value;
  float gradient_x, gradient_y;
};

/// A few pixels that move together: the unit in which robust weights and brightness offsets are judged.
struct PatchCell {
  cv::Point2d center_px;
  bool outline = false;  ///< its values are metalness, otherwise brightness
  double height_px = 0;  ///< of the visible surface over the plane of the outline: an instrument is round
  std::vector<CellSample> samples;
};

/// What one camera saw of the far part of the instrument; one list of cells per pyramid level.
struct PatchTemplate {
  std::array<std::vector<PatchCell>, ImageLayers::kLevels> cells;
};

/// The instrument from its tip back to `length_px` along the axis. Inside the mask the samples are brightness, in a
/// band around its outline metalness.
PatchTemplate make_template(const ImageLayers& layers, const cv::Mat& mask, const ImageTip& tip, double length_px);

/// Where a cell goes: its centre, and the linear part of the motion around it.
struct CellWarp {
  cv::Point2d center_px;
  cv::Matx22d linear = cv::Matx22d::eye();
};

/// Expected noise of the two layers, which is also their weight against each other; grey levels.
struct LayerNoise {
  float brightness;
  float metal;
};

/// What is eliminated of a cell's brightness: an offset, which holds over a long way, or gain and a linear ramp as
/// well, which take the bias of shading that stays with the light off a short one, and leave too little to find a long
/// one by.
enum class Light { offset, gain_and_ramp };

/// Lucas-Kanade's normal equations of one cell for a shift of its centre, with outliers weighted down. Residuals are in
/// units of their expected noise.
struct CellEquations {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double information = 0;       ///< gradient energy that kept its weight
  double full_information = 0;  ///< gradient energy of the template
  double squared_error = 0;     ///< robustly weighted
  double weight = 0;
};

CellEquations cell_equations(const PatchCell& cell, const ImageLayers& layers, int level, const CellWarp& warp,
                             const LayerNoise& noise, Light light_model);

}  // namespace palpate
