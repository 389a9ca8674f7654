#pragma once

#include <filesystem>
#include <functional>

#include "palpate/contact/contact_options.h"
#include "palpate/elastic/material.h"
#include "palpate/simulate/simulate_options.h"
#include "palpate/volume/attachments.h"

namespace palpate {

/// What was made, and what the estimator's scene file has to say about it.
struct DejaVuSummary {
  int frames = 0;
  int first_contact_frame = -1;
  int last_contact_frame = -1;
  double peak_force_N = 0;
  int peak_frame = -1;

  int truth_elements = 0;
  int truth_nodes = 0;
  int tied_nodes = 0;
  double largest_residual = 0;       ///< of all frames
  double smallest_volume_ratio = 1;  ///< smallest det F of all frames
  double solve_s = 0;                ///< time of all equilibria
  double draw_s = 0;                 ///< time of all pictures and videos

  std::vector<cv::Point2d> organ_region_px;  ///< outline of the organ in the first left image, without the instrument
  double thickness_mm = 0;                   ///< of the organ along the optical axis, mean
  Vec3 contact_mm = Vec3::Zero();            ///< at rest
  Vec3 contact_normal = Vec3::UnitZ();       ///< outwards
  double contact_radius_mm = 0;              ///< of the patch that the instrument holds in the truth
  Grip grip = Grip::automatic;               ///< what the estimator is told
};

/// DejaVu (the paper's [22]): stereo video with known force. Writes left.mp4, right.mp4, calibration.yaml, truth.csv
/// and what options.write asks for into `folder` (made if missing). The truth is in equilibrium in every frame
/// (quasi-static, weightless, unstressed at rest); the patch of tissue that the instrument holds moves with it rigidly
/// from grasp to release; a push slides with friction (see PushedTissue). `contact` gives the radius of the patch where
/// the gesture does not, and the friction. `progress(done, total)` is called after every step. Throws BadInput before
/// anything is written: gesture that misses the organ, tissue that finds no equilibrium, ...; Unfinished when a file
/// cannot be written.
DejaVuSummary simulate_dejavu(const SimulateOptions& options, const TissueOptions& tissue,
                              const AttachmentOptions& attachments, const ContactOptions& contact,
                              const std::filesystem::path& folder,
                              const std::function<void(int done, int total)>& progress = {});

}  // namespace palpate
