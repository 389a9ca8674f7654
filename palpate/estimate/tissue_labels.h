#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/elastic/material.h"

namespace palpate {

/// One item of `map.labels`: a part of the organ with a stiffness of its own.
struct TissueLabel {
  std::string name;
  std::vector<cv::Point2d> region_px;  ///< in the left image as recorded; or
  std::filesystem::path mask;          ///< an image of that size, not black where the tissue is
  Stiffness tissue;
};

/// Binds the list `labels` of the group that holds it.
void describe(Settings& map, std::vector<TissueLabel>& labels);

/// Elements whose middle lies behind the region of the k-th item get the label k + 1, of several the last; through the
/// whole depth. `project_px` maps a point of the left camera frame to a pixel of the recorded left image, which has
/// `image_size`. Throws BadInput: mask unreadable or of another size, no element behind the region.
void assign_labels(TetMesh& mesh, const std::vector<TissueLabel>& labels, cv::Size image_size,
                   const std::function<cv::Point2d(const Vec3&)>& project_px);

}  // namespace palpate
