#pragma once

#include "palpate/core/settings.h"
#include "palpate/elastic/material.h"
#include "palpate/estimate/force_estimate.h"
#include "palpate/feedback/colour_map.h"
#include "palpate/feedback/rasterize.h"
#include "palpate/feedback/strip_chart.h"
#include "palpate/stereo/rig.h"

namespace palpate {

enum class OverlayRegion { whole, around };

/// `overlay` of the scene file.
struct OverlayOptions {
  OverlayRegion region =
      OverlayRegion::whole;  ///< stress on the whole organ (Fig. 4) or around the instrument (Fig. 5)
  double radius_mm = 15;     ///< of `around`
  ColourMap colour_map = ColourMap::viridis;
  double opacity = 0.65;        ///< of the highest stress; less stress is more transparent, no stress leaves the tissue
  double stress_scale_kPa = 0;  ///< end of the colour bar; 0 = follows the highest stress in round steps
  bool chart = true;            ///< force over time
  double chart_duration_s = 10;  ///< shown by the chart
};

void describe(Settings& settings, OverlayOptions& options);

/// Eq. 6: I_f = I_l o [C_l Lambda(u, F_f, sigma)]. Keeps what must not flicker from frame to frame: the ends of the
/// scales and the history of the force.
class OverlayPainter {
 public:
  OverlayPainter(const Rectification& rectification, const TissueOptions& tissue, const OverlayOptions& options = {});

  /// I_f: the left image as recorded (8-bit BGR) with stress on the tissue, the force at the tip and the readings.
  /// Frames in order of time. Throws std::invalid_argument when the image is not of the rig's size.
  cv::Mat paint(const cv::Mat& left_bgr, const ForceEstimate& estimate);

 private:
  void follow_scales(const ForceEstimate& estimate);
  void paint_stress(cv::Mat& image, const ForceEstimate& estimate);
  bool shows_instrument(const cv::Mat& rectified_mask, int x, int y) const;
  void draw_force(cv::Mat& image, const ForceEstimate& estimate) const;
  void draw_readings(cv::Mat& image, const ForceEstimate& estimate) const;
  void draw_frame(cv::Mat& image, const ForceEstimate& estimate) const;
  cv::Scalar force_colour(const ForceEstimate& estimate) const;

  Rectification rectification_;
  TissueOptions tissue_;
  OverlayOptions options_;
  ColourTable colours_;
  cv::Mat rectified_px_;  // CV_16SC2, rectified pixel of each recorded one; empty when they are the same
  double stress_scale_kPa_;
  double nodal_force_scale_N_ = 0;
  StripChart chart_;
  VisibleTriangles visible_;
  std::vector<ScreenVertex> vertices_;
};

}  // namespace palpate
