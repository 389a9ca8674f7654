#pragma once

#include <optional>

#include "palpate/instrument/instrument_example.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/instrument/patch_cells.h"
#include "palpate/instrument/segment.h"
#include "palpate/instrument/segmentation_network.h"

namespace palpate {

/// What one eye shows of instruments.
struct FoundInstruments {
  cv::Mat mask;      ///< 255 = instrument
  cv::Mat likeness;  ///< 8-bit, 128 at the edge; empty: the colours tell
};

/// Finds instruments in the images of one eye in the way that the options choose. Our network knows more kinds of
/// pictures than the colours do, which in turn draw the sharper outline: they do so while both find the same.
class InstrumentFinder {
 public:
  /// `static_bgr`: rectified, of the map frame; `organ_mask`: 255 = surely tissue in it; may be empty.
  InstrumentFinder(const InstrumentOptions& options, const cv::Mat& static_bgr, const cv::Mat& organ_mask);

  FoundInstruments find(const cv::Mat& bgr);
  /// The colours of the instrument on which `example` (255) lies in this image.
  ExampleColours learn(const cv::Mat& bgr, const cv::Mat& example) const;
  /// From now on these colours count too.
  void use(const ExampleColours& colours) { example_ = colours; }
  /// What a template is made of and aligned with.
  ImageLayers layers(const cv::Mat& bgr, const cv::Rect& region, const FoundInstruments& found) const;
  /// 255 inside the picture.
  const cv::Mat& picture_area() const { return model_.picture_area; }

 private:
  SegmentationModel model_;
  cv::Mat entrance_;  ///< 255 near the border of the picture
  std::optional<SegmentationNetwork> network_;
  std::optional<ExampleColours> example_;
  bool looks_ = true;
  bool ours_ = false;      ///< the network
  double agreement_ = -1;  ///< overlap of what our network and the colours found so far; negative: not known

  FoundInstruments find_by_colours(const cv::Mat& bgr);

  cv::Mat corrected(const cv::Mat& bgr, const cv::Mat& probability) const;
  cv::Mat probability(const cv::Mat& bgr) const;
};

}  // namespace palpate
