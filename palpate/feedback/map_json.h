#pragma once

#include <string>

#include "palpate/estimate/tissue_map.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// Content of map.json: counts, times, coverage, quality of the mesh, tissue, and the rotation between the left camera
/// frame and the rectified one.
std::string map_json(const TissueMap& map, const Rectification& rectification);

}  // namespace palpate
