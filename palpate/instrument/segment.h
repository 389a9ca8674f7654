#pragma once

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

/// Appearance of the scene, adapted at the start from static frames (colour statistics of the organ region).
struct SegmentationModel {
  cv::Mat reference_bgr;  ///< rectified image of the static frame, same eye as the images to segment
  cv::Mat reference_mask; ///< 255 where the static frame already shows an instrument
  // The owner of this file adds what the colour model needs.
};

/// Learns what is tissue from a static frame of one eye. `organ_mask` (255 = surely tissue; may be empty) narrows it.
SegmentationModel learn_segmentation(const cv::Mat& static_bgr, const cv::Mat& organ_mask);

/// 255 where one image shows an instrument: metal (grey, low chroma) on tissue (red), changed against the static frame,
/// highlights of the tissue left out, small holes closed, blobs that do not look like an instrument dropped.
cv::Mat segment_instrument(const cv::Mat& bgr, const SegmentationModel& model);

}  // namespace palpate
