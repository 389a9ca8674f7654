#pragma once

#include <vector>

#include "palpate/stereo/match.h"

namespace palpate {

/// One disparity map of a phase in which camera and tissue stand still, from the maps of its frames (all of one size).
/// Each pixel takes the median over time of the frames that agree with it. It stays empty where it was measured in
/// fewer than half of the frames, where fewer than half of them agree, and where it wanders more than the stated
/// deviations allow, because what is seen there moves. The deviation falls by the square root of the number of frames
/// as far as it scatters over time; what the frames have in common (calibration, texture, interpolation) remains.
/// Throws BadInput: no map, or maps of different size.
DisparityMap fuse(const std::vector<DisparityMap>& frames);

}  // namespace palpate
