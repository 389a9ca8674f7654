#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// One row of truth.csv.
struct TruthRow {
  int frame = 0;
  double time_s = 0;
  bool in_contact = false;
  Vec3 force_N = Vec3::Zero();  ///< of the instrument on the tissue, left camera frame
  Vec3 tip_mm = Vec3::Zero();   ///< far end of the jaws; in contact the centre of the footprint
  bool visible = false;         ///< the tip lies inside both images
};

/// Throws Unfinished when the file cannot be written; so do the others.
void write_truth(const std::filesystem::path& file, const std::vector<TruthRow>& rows);

/// OpenCV FileStorage: K1 D1 K2 D2 R T (mm), image_width, image_height.
void write_calibration(const std::filesystem::path& file, const SimulatedCamera& camera);

/// left.mp4 and right.mp4, written frame by frame at high quality.
class StereoVideoWriter {
 public:
  StereoVideoWriter(const std::filesystem::path& folder, const SimulatedCamera& camera);
  ~StereoVideoWriter();
  StereoVideoWriter(StereoVideoWriter&&) noexcept;

  void write(const StereoFrame& frame);

 private:
  struct Files;
  std::unique_ptr<Files> files_;
};

}  // namespace palpate
