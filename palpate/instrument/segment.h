#pragma once

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

/// Appearance of the scene, adapted at the start from static frames (colour statistics of the organ region).
struct SegmentationModel {
  cv::Mat reference_bgr;   ///< rectified image of the static frame, same eye as the images to segment
  cv::Mat reference_mask;  ///< 255 where the static frame already shows an instrument
  cv::Mat picture_area;    ///< 255 inside the picture, 0 in the black surround of scope or rectification
  cv::Mat still_grey;      ///< 255 where the static frame is grey without an instrument (highlights, fat); half size
  cv::Mat reference_half;  ///< the static frame at half size
  double tissue_redness = 0.5;  ///< redness (see metalness) that most of the organ exceeds
  double least_value = 24;      ///< darker pixels have no colour to judge, grey levels
};

/// Learns what is tissue from a static frame of one eye. `organ_mask` (255 = surely tissue; may be empty) narrows it.
SegmentationModel learn_segmentation(const cv::Mat& static_bgr, const cv::Mat& organ_mask);

/// 255 where one image shows an instrument: metal (grey, low chroma) on tissue (red), changed against the static frame,
/// highlights of the tissue left out, small holes closed, blobs that do not look like an instrument dropped.
cv::Mat segment_instrument(const cv::Mat& bgr, const SegmentationModel& model);

/// How much each pixel looks like metal, 8-bit: 255 = without any redness (r - min(g, b)) / max(r, g, b), 128 = half
/// the redness of tissue, 0 = as red as tissue or too dark to tell.
cv::Mat metalness(const cv::Mat& bgr, const SegmentationModel& model);

}  // namespace palpate
