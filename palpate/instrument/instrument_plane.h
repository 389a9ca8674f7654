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
  double slope_deviation = 0;                           ///< of the slope along the axis, px/px
  double agreement = 0;                                 ///< fraction of the template's gradients that fit, 0..1

  double disparity_at(const cv::Point2d& left_px) const {
    return disparity[0] + disparity[1] * (left_px.x - origin_px.x) + disparity[2] * (left_px.y - origin_px.y);
  }
};

/// Right row minus left row of what is the same point, as the calibration leaves it.
struct RowOffset {
  double px = 0;
  double deviation_px = 0.5;  ///< left by a good calibration
};

/// The row offset of the whole picture, from corners of a static pair; as good as unknown where it has too few.
RowOffset measure_row_offset(const cv::Mat& left_bgr, const cv::Mat& right_bgr);

/// What is known before the right image is looked at.
struct PlanePrior {
  double disparity_px = 0;  ///< at the tip; searched +- 12 px around
  RowOffset rows;
  const InstrumentPlane* before =
      nullptr;  ///< of the last frame, if it had one: the slope changes little from what was known
};

/// Aligns the left template with the right image. Nothing when too little of it fits.
std::optional<InstrumentPlane> match_instrument(const PatchTemplate& left, const ImageTip& tip,
                                                const ImageLayers& right, double focal_px, const PlanePrior& prior);

}  // namespace palpate
