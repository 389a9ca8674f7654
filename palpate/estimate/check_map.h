#pragma once

#include <filesystem>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/stereo/match.h"

namespace palpate {

/// Compares a given body with what the cameras measured: its faces that look at the camera have to lie in view, near
/// the measured tissue. Throws BadInput naming `volume_file` and how far off it lies, with a hint at volume_unit.
void require_body_where_seen(const Surface& body, const DisparityMap& disparity, const Rectification& rectification,
                             const cv::Mat& organ_mask, const std::filesystem::path& volume_file);

/// A piece of the body without a fixed node could float away: no equilibrium. Throws BadInput.
void require_every_piece_held(const TetMesh& mesh, const std::vector<int>& fixed_nodes);

}  // namespace palpate
