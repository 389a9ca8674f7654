#pragma once

#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/infer/band.h"
#include "palpate/infer/contact_tangent.h"
#include "palpate/infer/correlation.h"
#include "palpate/infer/hold_filter.h"

namespace palpate {

enum class FrameStatus { ok, no_contact, tool_lost, not_converged, map_stale };

std::string status_name(FrameStatus status);

/// Time of each stage of one frame, ms.
struct FrameTimes {
  double rectify_ms = 0;
  double track_ms = 0;
  double contact_ms = 0;
  double solve_ms = 0;
  double stress_ms = 0;
  double draw_ms = 0;
  double total_ms() const { return rectify_ms + track_ms + contact_ms + solve_ms + stress_ms + draw_ms; }
};

/// The answer to one frame for one instrument; one row of forces.csv. Forces of the instrument on the tissue, left
/// camera frame.
struct ForceEstimate {
  int frame = 0;
  double time_s = 0;
  FrameStatus status = FrameStatus::no_contact;
  bool in_contact = false;
  Vec3 force_N = Vec3::Zero();
  double mean_nodal_force_N = 0;  ///< F_f of the paper
  Vec3 tip_mm = Vec3::Zero();
  Vec3 tip_velocity_mm_per_s = Vec3::Zero();  ///< as the images or the track tell it; zero where they do not
  ContactTangent tangent;                     ///< in contact: how the force follows the tip
  double max_von_mises_kPa = 0;
  double residual = 0;
  double misfit_mm = 0;
  ForceBand band;                ///< from the images, at the stated tissue
  ForceBand total_band;          ///< with what is not known of the tissue
  ForceCorrelation correlation;  ///< where the band comes from
  Hold grip = Hold::free;
  double p_contact = 0;
  double footprint_mm = 0;       ///< radius as estimated
  Vec3 scene_mm = Vec3::Zero();  ///< motion of the middle of the map's visible surface since the map
  std::vector<std::string> warnings;
  FrameTimes times;
  std::vector<ForceEstimate> further;  ///< of the further instruments (forces_2.csv), without what is drawn

  /// What the overlay draws: the map as all instruments deform it. Empty where nothing was computed.
  std::vector<Vec3> deformed_nodes_mm;
  std::vector<Triangle> boundary;  ///< outward triangles of these nodes that were seen (finer than the map's around a
                                   ///< contact)
  std::vector<double> node_von_mises_kPa;
  cv::Mat left_instrument_mask;  ///< rectified left image, 255 = instrument
};

}  // namespace palpate
