#pragma once

#include <optional>

#include "palpate/instrument/instrument_example.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/instrument/patch_cells.h"
#include "palpate/instrument/segment.h"
#include "palpate/instrument/segmentation_network.h"
#include "palpate/instrument/still_parts.h"

namespace palpate {

/// What one camera shows of instruments.
struct FoundInstruments {
  cv::Mat mask;      ///< 255 = instrument
  cv::Mat likeness;  ///< 8-bit, 128 at the edge; empty: the colours tell
  cv::Mat still;     ///< 255 = an instrument of the static frame that still shows; smaller; empty: not known
};

/// Finds instruments in the images of one camera in the way that the options choose.
class InstrumentFinder {
 public:
  /// `static_bgr`: rectified, of the map frame; `organ_mask`: 255 = surely tissue in it; may be empty.
  InstrumentFinder(const InstrumentOptions& options, const cv::Mat& static_bgr, const cv::Mat& organ_mask);

  /// In the way of the options; with our network, in that alone.
  FoundInstruments find(const cv::Mat& bgr);
  /// Whether our network and the colours are both to be asked (`WayChoice`).
  bool has_both_ways() const { return ours_ && !example_; }
  FoundInstruments find_by_colours(const cv::Mat& bgr);
  FoundInstruments find_by_network(const cv::Mat& bgr) const;
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
  StillParts still_;                               ///< at the size of our network
  cv::Mat area_of_network_, entrance_of_network_;  ///< the same
  bool looks_ = true;
  bool ours_ = false;  ///< the network

  cv::Mat corrected(const cv::Mat& bgr, const cv::Mat& probability) const;
  cv::Mat probability(const cv::Mat& bgr) const;
};

}  // namespace palpate
