#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "palpate/elastic/material.h"
#include "palpate/estimate/force_estimate.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// What every stream has to know of a run before its first frame.
struct StreamScene {
  TissueOptions tissue;
  std::vector<Vec3> rest_nodes_mm;  ///< of the map, left camera frame
  std::vector<Triangle> rest_boundary;
  Camera left;
  double depth_mm = 100;  ///< of the middle of the map
  double frame_s = 0.04;  ///< time between two frames
  double friction = 0.3;  ///< Coulomb coefficient of a push
};

StreamScene stream_scene(const TissueMap& map, const StereoRig& rig, double fps, double friction);

/// One frame as the streams pass it on; shared, never changed.
struct StreamFrame {
  ForceEstimate estimate;
  int instruments = 1;     ///< 2 from the first frame on in which a second one is seen
  cv::Mat overlay;         ///< 8-bit BGR, of the left image as recorded; may be empty
  int64_t decoded_ns = 0;  ///< steady clock, when the frame's pictures were there
  int64_t wall_ns = 0;     ///< the same moment since 1970
};
using SharedFrame = std::shared_ptr<const StreamFrame>;

/// That of the first or of the second instrument.
const ForceEstimate& estimate_of(const StreamFrame& frame, int instrument);

/// A force that may be used.
bool has_force(const ForceEstimate& estimate);
/// A tip that may be used.
bool has_tip(const ForceEstimate& estimate);

/// PalpateState: force, band, status, tissue, frame, stamp, validity of one instrument as one JSON object.
std::string state_json(const StreamFrame& frame, const TissueOptions& tissue, int instrument = 0);

}  // namespace palpate
