#include "palpate/instrument/instrument_finder.h"

#include <opencv2/imgproc.hpp>

#include "palpate/instrument/follow_edges.h"

namespace palpate {
namespace {

constexpr double kDoubtOfColours = 0.2;  // what the colour model says is so with this probability not so
constexpr double kSmallest = 0.001;      // of the picture; what is smaller is a highlight or a clip

/// Without what is too small to be an instrument, and with small holes closed.
cv::Mat without_specks(const cv::Mat& mask) {
  cv::Mat labels, stats, centres, result;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centres, 8);
  std::vector<uchar> stays(static_cast<size_t>(count), 255);
  stays[0] = 0;
  const double smallest = kSmallest * static_cast<double>(mask.total());
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
  model_ = colours ? learn_segmentation(static_bgr, organ_mask) : SegmentationModel();
  if (!colours) model_.picture_area = find_picture_area(static_bgr);
  if (!looks_ || colours) return;
  if (options.segmentation == "learned")
    network_.emplace(static_bgr.size());
  else
    network_.emplace(options.segmentation, options.network, static_bgr.size());
}

/// What is known without an example.
cv::Mat InstrumentFinder::probability(const cv::Mat& bgr) const {
  if (network_) return network_->probability(bgr);
  cv::Mat half, result;
  cv::resize(segment_instrument(bgr, model_), half, {}, 0.5, 0.5, cv::INTER_AREA);
  half.convertTo(result, CV_32F, (1 - 2 * kDoubtOfColours) / 255, kDoubtOfColours);
  return result;
}

ExampleColours InstrumentFinder::learn(const cv::Mat& bgr, const cv::Mat& example) const {
  return {bgr, example, network_ ? network_->probability(bgr) : cv::Mat()};
}

FoundInstruments InstrumentFinder::find(const cv::Mat& bgr) {
  if (!looks_) return {cv::Mat::zeros(bgr.size(), CV_8U), {}};
  if (!network_ && !example_) {
    forget_what_left(bgr, model_);
    return {segment_instrument(bgr, model_), {}};
  }
  FoundInstruments found;
  found.likeness = follow_edges(bgr, example_ ? example_->counted_in(bgr, probability(bgr)) : probability(bgr));
  found.mask = without_specks(found.likeness >= 128);
  found.likeness.setTo(0, ~found.mask & (found.likeness >= 128));
  return found;
}

ImageLayers InstrumentFinder::layers(const cv::Mat& bgr, const cv::Rect& region, const FoundInstruments& found) const {
  return found.likeness.empty() ? make_layers(bgr, region, model_) : make_layers(bgr, region, found.likeness);
}

}  // namespace palpate
