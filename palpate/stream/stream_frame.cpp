#include "palpate/stream/stream_frame.h"

#include <array>
#include <nlohmann/json.hpp>

namespace palpate {

namespace {

std::array<double, 3> numbers(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

const char* grip_name(Hold hold) {
  switch (hold) {
    case Hold::grasp:
      return "grasp";
    case Hold::push:
      return "push";
    case Hold::slide:
      return "slide";
    default:
      return "free";
  }
}

}  // namespace

StreamScene stream_scene(const TissueMap& map, const StereoRig& rig, double fps, double friction) {
  StreamScene scene;
  scene.tissue = map.tissue;
  scene.rest_nodes_mm = map.mesh.nodes_mm;
  scene.rest_boundary = boundary_triangles(map.mesh);
  scene.left = rig.left;
  double depth_sum_mm = 0;
  for (const Vec3& vertex : map.surface.vertices_mm) depth_sum_mm += vertex.z();
  if (!map.surface.vertices_mm.empty())
    scene.depth_mm = depth_sum_mm / static_cast<double>(map.surface.vertices_mm.size());
  if (fps > 0) scene.frame_s = 1 / fps;
  scene.friction = friction;
  return scene;
}

const ForceEstimate& estimate_of(const StreamFrame& frame, int instrument) {
  return instrument == 0 ? frame.estimate : frame.estimate.further.at(static_cast<size_t>(instrument) - 1);
}

bool has_force(const ForceEstimate& estimate) {
  return (estimate.status == FrameStatus::ok || estimate.status == FrameStatus::no_contact) &&
         estimate.force_N.allFinite();
}

bool has_tip(const ForceEstimate& estimate) {
  return estimate.status != FrameStatus::tool_lost && estimate.tip_mm.allFinite();
}

std::string state_json(const StreamFrame& frame, const TissueOptions& tissue, int instrument) {
  const ForceEstimate& e = estimate_of(frame, instrument);
  nlohmann::ordered_json json;
  json["frame"] = e.frame;
  json["time_s"] = e.time_s;
  json["stamp_s"] = static_cast<double>(frame.wall_ns) * 1e-9;
  json["valid"] = has_force(e);
  json["status"] = status_name(e.status);
  json["in_contact"] = e.in_contact;
  json["coordinates"] = "left camera: x right, y down, z forward, mm";
  // A force that may not be used is not there to be misread.
  if (has_force(e)) {
    json["force_N"] = numbers(e.force_N);
    json["force_magnitude_N"] = e.force_N.norm();
    json["band_N"] = {e.band.low_N, e.band.high_N};
    json["total_band_N"] = {e.total_band.low_N, e.total_band.high_N};
    json["max_von_mises_kPa"] = e.max_von_mises_kPa;
  }
  if (has_tip(e)) json["tip_mm"] = numbers(e.tip_mm);
  json["grip"] = grip_name(e.grip);
  json["p_contact"] = e.p_contact;
  json["law"] = law_name(tissue.law);
  json["young_modulus_kPa"] = tissue.young_modulus_kPa;
  json["poisson_ratio"] = tissue.poisson_ratio;
  json["warnings"] = e.warnings;
  return json.dump();
}

}  // namespace palpate
