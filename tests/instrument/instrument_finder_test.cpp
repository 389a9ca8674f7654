#include "palpate/instrument/instrument_finder.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "palpate/instrument/follow_edges.h"
#include "tests/instrument/drawn_scene.h"

namespace palpate {
namespace {

double overlap(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

TEST(FollowEdges, BringsACoarseMaskToTheEdgeThatThePictureShows) {
  const test::DrawnInstrument instrument;
  const cv::Mat image = test::draw_pair({}, instrument, 1).left, truth = test::drawn_mask(instrument);
  cv::Mat coarse, probability;
  cv::resize(truth, coarse, {image.cols / 6, image.rows / 6}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(coarse, coarse, {5, 5}, 1);
  coarse.convertTo(probability, CV_32F, 1.0 / 255);
  cv::Mat as_it_is;
  cv::resize(coarse, as_it_is, image.size(), 0, 0, cv::INTER_LINEAR);
  const double before = overlap(as_it_is >= 128, truth),
               after = overlap(follow_edges(image, probability) >= 128, truth);
  EXPECT_GT(after, 0.95);
  EXPECT_GT(after, before - 0.01);
}

TEST(FollowEdges, IsNothingWhereNothingIsLikely) {
  const cv::Mat image = test::draw_pair({}, {}, 1).left;
  EXPECT_EQ(cv::countNonZero(follow_edges(image, cv::Mat(32, 64, CV_32F, cv::Scalar(0.01)))), 0);
}

TEST(InstrumentFinder, LooksForNothingWhereTheOptionsSayNone) {
  InstrumentOptions options;
  options.segmentation = "none";
  const cv::Mat image = test::draw_pair({}, {}, 1).left;
  InstrumentFinder finder(options, image, {});
  const FoundInstruments found = finder.find(image);
  EXPECT_EQ(found.mask.size(), image.size());
  EXPECT_EQ(cv::countNonZero(found.mask), 0);
}

TEST(InstrumentTracker, SeesNoTipWhereTheOptionsSayNone) {
  InstrumentOptions options;
  options.segmentation = "none";
  test::DrawnInstrument instrument;
  InstrumentTracker tracker(options, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  const auto seen = tracker.update(test::draw_pair({}, instrument, 1));
  EXPECT_FALSE(seen.tips[0].visible);
  EXPECT_EQ(cv::countNonZero(seen.left_mask), 0);
  EXPECT_EQ(seen.left_mask.size(), seen.right_mask.size());
}

TEST(InstrumentFinder, LearnsTheColoursOfTheInstrumentThatAnOperatorOutlines) {
  const test::DrawnInstrument instrument;
  const cv::Mat image = test::draw_pair({}, instrument, 1).left, truth = test::drawn_mask(instrument);
  cv::Mat shaft;
  cv::erode(truth, shaft, cv::Mat::ones(15, 15, CV_8U));
  const ExampleColours colours(image, shaft, {});
  // Without any other knowledge than the example.
  const cv::Mat unknown(image.rows / 4, image.cols / 4, CV_32F, cv::Scalar(0.3));
  const cv::Mat mask = follow_edges(image, colours.counted_in(image, unknown)) >= 128;
  EXPECT_GT(overlap(mask, truth), 0.8);
}

}  // namespace
}  // namespace palpate
