#pragma once

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

/// Appearance of the scene, adapted at the start from static frames (colour statistics of the organ region).
struct SegmentationModel {
  cv::Mat reference_bgr;   ///< rectified image of the static frame, same camera as the images to segment
  cv::Mat reference_mask;  ///< 255 where the static frame already shows an instrument
  cv::Mat picture_area;    ///< 255 inside the picture, 0 in the black surround of scope or rectification
  cv::Mat picture_area_half;
  cv::Mat reference_half;  ///< the static frame at half size
  /// Where the static frame is grey without an instrument (highlights, tendon): how dark and how bright such pixels are
  /// nearby, 255 and 0 where there are none; half size.
  cv::Mat still_darkest, still_brightest;
  cv::Mat still_at_border;  ///< 255 where that hangs together with the border and might be an instrument; half size
  /// The grey pixels themselves of each such part, numbered from 1; 0 elsewhere; half size.
  cv::Mat still_parts;
  /// Redness (see metalness) that most of the tissue around exceeds, in 255ths: pale tissue is told from metal by less
  /// colour than red tissue is. Of the whole image, and at half size.
  cv::Mat tissue_redness, tissue_redness_half;
  /// Least and greatest redness of the static frame within a few pixels, in 255ths; half size.
  cv::Mat min_redness_half, max_redness_half;
  double min_value = 24;  ///< darker pixels have no colour to judge, grey levels
};

/// 255 where the picture is: everything but the dark surround that touches the border of the image.
cv::Mat find_picture_area(const cv::Mat& bgr);

/// Learns what is tissue from a static frame of one camera. `organ_mask` (255 = surely tissue; may be empty) narrows
/// it.
SegmentationModel learn_segmentation(const cv::Mat& static_bgr, const cv::Mat& organ_mask);

/// 255 where one image shows an instrument: metal (grey, low chroma) on tissue (red), changed against the static frame,
/// highlights of the tissue left out, small holes closed, blobs that do not look like an instrument dropped.
cv::Mat segment_instrument(const cv::Mat& bgr, const SegmentationModel& model);

/// Takes what stood grey at the border in the static frame and has left since for what it was, an instrument that was
/// not recognised: where one image shows tissue instead, nothing is expected to stand still any more.
void forget_what_left(const cv::Mat& bgr, SegmentationModel& model);

/// How much each pixel of a part of the image looks like metal, 8-bit: 255 = without any redness
/// (r - g + (g - b) / 2) / max(r, g, b), 128 = half the redness of the tissue there, 0 = as red as tissue or too dark
/// to tell.
cv::Mat metalness(const cv::Mat& bgr, const cv::Rect& part, const SegmentationModel& model);

}  // namespace palpate
