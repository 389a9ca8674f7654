#pragma once

#include "palpate/stereo/rig.h"

namespace palpate {

/// The rig of pictures of this size as OpenCV's FileStorage (K1 D1 K2 D2 R T, mm), which read_rig reads back. Throws
/// Unfinished where the file cannot be written.
void write_rig(const std::filesystem::path& file, const StereoRig& rig, cv::Size picture_size);

}  // namespace palpate
