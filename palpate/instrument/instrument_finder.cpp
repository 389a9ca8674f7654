#include "palpate/instrument/instrument_finder.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "palpate/instrument/follow_edges.h"
#include "palpate/instrument/grey_evidence.h"

namespace palpate {
namespace {

constexpr double kDoubtOfColours = 0.2;  // what the colour model says is so with this probability not so
constexpr double kSurelyNot = 1e-4;      // probability
constexpr double kSmallest = 0.004;      // of the image; what is smaller is a highlight, a pin or a clip
constexpr double kFromBorder = 0.1;  // of the image's width, in which an instrument begins, if its shaft is too dark

/// 255 near the border of the picture, through which instruments come.
cv::Mat entrance_of(const cv::Mat& picture_area) {
  cv::Mat framed, from_border;
  cv::copyMakeBorder(picture_area, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::distanceTransform(framed, from_border, cv::DIST_L2, 3);
  return cv::Mat(from_border <= kFromBorder * picture_area.cols)(cv::Rect({1, 1}, picture_area.size()));
}

/// Without what is too small to be an instrument or does not come from the border.
cv::Mat instruments_of(const cv::Mat& mask, const cv::Mat& entrance) {
  cv::Mat labels, stats, centres, result;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centres, 8);
  std::vector<uchar> stays(static_cast<size_t>(count), 0);
  const double smallest = kSmallest * static_cast<double>(mask.total());
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (entrance.at<uchar>(y, x)) stays[static_cast<size_t>(labels.at<int>(y, x))] = 255;
  stays[0] = 0;
  for (int i = 1; i < count; ++i)
    if (stats.at<int>(i, cv::CC_STAT_AREA) < smallest) stays[static_cast<size_t>(i)] = 0;
  result = cv::Mat::zeros(mask.size(), CV_8U);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) result.at<uchar>(y, x) = stays[static_cast<size_t>(labels.at<int>(y, x))];
  return result;
}

}  // namespace

InstrumentFinder::InstrumentFinder(const InstrumentOptions& options, const cv::Mat& static_bgr,
                                   const cv::Mat& organ_mask) {
  looks_ = options.segmentation != "none";
  const bool colours = options.segmentation == "colour";
  ours_ = options.segmentation == "learned";
  model_ = colours || ours_ ? learn_segmentation(static_bgr, organ_mask) : SegmentationModel();
  if (model_.picture_area.empty()) model_.picture_area = find_picture_area(static_bgr);
  entrance_ = entrance_of(model_.picture_area);
  if (!looks_ || colours) return;
  if (!ours_) {
    network_.emplace(options.segmentation, options.network, static_bgr.size());
    return;
  }
  network_.emplace(static_bgr.size());
  const cv::Mat likely = network_->probability(static_bgr);
  cv::resize(model_.picture_area, area_of_network_, likely.size(), 0, 0, cv::INTER_NEAREST);
  cv::resize(entrance_, entrance_of_network_, likely.size(), 0, 0, cv::INTER_NEAREST);
  cv::Mat small;
  cv::resize(static_bgr, small, likely.size(), 0, 0, cv::INTER_AREA);
  still_ = StillParts(small, corrected(static_bgr, likely) > 0.5);
}

/// What our network says, corrected by the colours of the picture: what is grey, and what looks like the instruments
/// that were found, is one sooner than the network believes; what was none in the static frame is none.
cv::Mat InstrumentFinder::corrected(const cv::Mat& bgr, const cv::Mat& probability) const {
  cv::Mat small;
  cv::resize(bgr, small, probability.size(), 0, 0, cv::INTER_AREA);
  const auto instruments = [&](const cv::Mat& likely) {
    return still_.left_out_of(instruments_of(likely > 0.5, entrance_of_network_), small, area_of_network_);
  };
  cv::Mat likely = grey_counted_in(small, probability);
  const cv::Mat found = instruments(likely);
  likely.setTo(kSurelyNot, (likely > 0.5) & ~found);
  if (cv::countNonZero(found) == 0) return likely;
  likely = ExampleColours::of_found(small, found).counted_in(small, likely);
  likely.setTo(kSurelyNot, (likely > 0.5) & ~instruments(likely));
  return likely;
}

/// What is known without an example.
cv::Mat InstrumentFinder::probability(const cv::Mat& bgr) const {
  if (ours_) return corrected(bgr, network_->probability(bgr));
  if (network_) return network_->probability(bgr);
  cv::Mat half, result;
  cv::resize(segment_instrument(bgr, model_), half, {}, 0.5, 0.5, cv::INTER_AREA);
  half.convertTo(result, CV_32F, (1 - 2 * kDoubtOfColours) / 255, kDoubtOfColours);
  return result;
}

ExampleColours InstrumentFinder::learn(const cv::Mat& bgr, const cv::Mat& example) const {
  return {bgr, example, network_ ? probability(bgr) : cv::Mat()};
}

FoundInstruments InstrumentFinder::find_by_colours(const cv::Mat& bgr) {
  forget_what_left(bgr, model_);
  return {segment_instrument(bgr, model_), {}, {}};
}

FoundInstruments InstrumentFinder::find_by_network(const cv::Mat& bgr) const {
  FoundInstruments found;
  found.likeness = follow_edges(bgr, example_ ? example_->counted_in(bgr, probability(bgr)) : probability(bgr));
  found.mask = instruments_of(found.likeness >= 128, entrance_);
  found.likeness.setTo(0, ~found.mask & (found.likeness >= 128));
  found.still = still_.in(bgr);
  return found;
}

FoundInstruments InstrumentFinder::find(const cv::Mat& bgr) {
  if (!looks_) return {cv::Mat::zeros(bgr.size(), CV_8U), {}, {}};
  return network_ || example_ ? find_by_network(bgr) : find_by_colours(bgr);
}

ImageLayers InstrumentFinder::layers(const cv::Mat& bgr, const cv::Rect& region, const FoundInstruments& found) const {
  return found.likeness.empty() ? make_layers(bgr, region, model_) : make_layers(bgr, region, found.likeness);
}

}  // namespace palpate
