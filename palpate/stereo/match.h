#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/stereo/rig.h"

namespace palpate {

enum class Matcher { quasi_dense, sgbm, dis, network };

struct MatchOptions {
  Matcher matcher = Matcher::quasi_dense;
  std::filesystem::path network;  ///< ONNX file of Matcher::network, see network.h
  double nearest_mm = 25;         ///< closest depth searched
  double farthest_mm = 400;       ///< farthest depth searched
};

/// Keys of `map` that belong to matching.
void describe(Settings& settings, MatchOptions& options);

/// Disparity of the rectified left image, left x minus right x, px. All maps have the size of the image.
struct DisparityMap {
  cv::Mat disparity_px;      ///< CV_32F, NaN where nothing was matched
  cv::Mat deviation_px;      ///< CV_32F, one standard deviation of the disparity, the calibration's part in it
  cv::Mat correlation;       ///< CV_32F, ZNCC -1..1
  double row_offset_px = 0;  ///< matches lie this many rows lower in the right image (corrected for before matching)
  double calibration_deviation_px = 0;     ///< the part of every deviation that the calibration's error makes
  std::vector<std::string> warnings = {};  ///< sentences for the person at the screen
};

/// Dense disparity of a rectified pair where `mask` (8-bit, size of the image) is not zero, by the matcher that the
/// options name. Throws BadInput when the image has no texture to match, or when the matches have negative disparity
/// at infinity (left and right are swapped).
DisparityMap match(const RectifiedPair& pair, const Rectification& rectification, const cv::Mat& mask,
                   const MatchOptions& options);

}  // namespace palpate
