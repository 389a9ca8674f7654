#pragma once

#include <optional>

#include "palpate/instrument/patch_cells.h"

namespace palpate {

/// Disparity of the plane through the outline of the instrument (its axis, where it is round): a straight body has a
/// disparity that is linear in the image.
struct InstrumentPlane {
  cv::Point2d origin_px;                                ///< the tip in the left image
  Eigen::Vector3d disparity = Eigen::Vector3d::Zero();  ///< at the origin, px; its slope in x and in y, px/px
  double row_offset_px = 0;                             ///< right row minus left row
  double disparity_deviation_px = 0;                    ///< of the disparity at the origin
  double agreement = 0;                                 ///< share of the template's gradients that fit, 0..1

  double disparity_at(const cv::Point2d& left_px) const {
    return disparity[0] + disparity[1] * (left_px.x - origin_px.x) + disparity[2] * (left_px.y - origin_px.y);
  }
};

/// Aligns the left template with the right image, starting at `guess_px` of disparity at the tip (searched +- 12 px
/// around). Nothing when too little of it fits.
std::optional<InstrumentPlane> match_instrument(const PatchTemplate& left, const cv::Point2d& tip_px,
                                                const ImageLayers& right, double guess_px, double focal_px);

}  // namespace palpate
