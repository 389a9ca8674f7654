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

/// What `simulate.write` asks for, one file per frame; without effect where it asks for nothing.
class FrameFiles {
 public:
  FrameFiles(const std::filesystem::path& folder, const SimulatedFiles& wanted);

  /// surface/frame_0000.ply: binary PLY, left camera frame, mm.
  void write_surface(int frame, const Surface& organ) const;
  /// depth/left_0000.png: 16-bit, hundredths of a millimetre along the optical axis at pixel centres; 0 where there is
  /// nothing, 65535 beyond 655.35 mm.
  void write_depth(int frame, const cv::Mat& depth_mm) const;

 private:
  std::filesystem::path folder_;
  SimulatedFiles wanted_;
};

}  // namespace palpate
