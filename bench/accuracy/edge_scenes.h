#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/stereo/rig.h"

namespace palpate {

/// A rendered pair in which tissue has edges, and what is true of it; pixels of the left image.
struct EdgeScene {
  std::string name;
  StereoRig rig;
  StereoFrame frame;
  cv::Mat1f depth_mm;         ///< of whatever is seen
  cv::Mat1f tissue_depth_mm;  ///< without the instrument
  cv::Mat1b organ;            ///< 255 = the organ lies there, seen or behind the instrument
  cv::Mat1b instrument;       ///< 255 = an instrument is seen
};

/// A loop before a wall, two organs with a gap of 6 mm, an organ half hidden by a resting instrument, a fold whose edge
/// ends in the middle of the organ.
std::vector<EdgeScene> edge_scenes();

/// One row for each: cut against the true edge, faces across gaps, surface and coverage, what is closed behind the
/// instrument, time. Writes a picture of each map, mesh beside confidence, into `pictures` unless it is empty.
std::string edge_table(const std::filesystem::path& pictures = {});

}  // namespace palpate
