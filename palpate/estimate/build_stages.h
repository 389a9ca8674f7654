#pragma once

#include <functional>
#include <string>

#include "palpate/estimate/tissue_map.h"

namespace palpate {

/// Told the name of each stage as it begins: "rectify", "match", "triangulate", "edges", "surface", "register",
/// "volume", "attachments". What it throws ends the build.
using OnStage = std::function<void(const std::string& stage)>;

/// build_tissue_map(), watched.
TissueMap build_tissue_map(const std::vector<StereoFrame>& static_frames, const Rectification& rectification,
                           const MapOptions& options, const TissueOptions& tissue, const AttachmentOptions& attachments,
                           const OnStage& on_stage);

}  // namespace palpate
