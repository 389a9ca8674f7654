#include "palpate/instrument/instrument_finder.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "palpate/instrument/follow_edges.h"
#include "palpate/instrument/grey_evidence.h"
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

TEST(GreyEvidence, LiftsWhatIsGreyAndLowersWhatIsRed) {
  cv::Mat image(60, 80, CV_8UC3, cv::Scalar(60, 70, 150));
  const cv::Rect metal(0, 0, 20, 60);
  image(metal).setTo(cv::Scalar(120, 125, 122));
  const cv::Mat unsure = grey_counted_in(image, cv::Mat(image.size(), CV_32F, cv::Scalar(0.5)));
  EXPECT_GT(unsure.at<float>(30, 10), 0.6);
  EXPECT_LT(unsure.at<float>(30, 60), 0.45);
  // What the network is sure of stays, and darkness says nothing.
  EXPECT_LT(grey_counted_in(image, cv::Mat(image.size(), CV_32F, cv::Scalar(0.01))).at<float>(30, 10), 0.5);
  const cv::Mat dark(image.size(), CV_8UC3, cv::Scalar(5, 5, 5));
  EXPECT_NEAR(grey_counted_in(dark, cv::Mat(dark.size(), CV_32F, cv::Scalar(0.5))).at<float>(30, 10), 0.5, 1e-6);
}

TEST(InstrumentFinder, LeavesOutWhatIsSmallOrBeginsNowhereNearTheBorder) {
  const test::DrawnInstrument instrument;
  const cv::Mat truth = test::drawn_mask(instrument);
  cv::Mat image = test::draw_pair({}, instrument, 1).left, shaft, dots = cv::Mat::zeros(image.size(), CV_8U);
  cv::erode(truth, shaft, cv::Mat::ones(15, 15, CV_8U));
  cv::circle(dots, {150, 180}, 22, 255, cv::FILLED);
  cv::circle(dots, {30, 30}, 9, 255, cv::FILLED);
  ASSERT_EQ(cv::countNonZero(dots & truth), 0);
  image.setTo(cv::mean(image, shaft), dots);
  InstrumentFinder finder({}, test::draw_pair({.instrument = false}, {}, 0).left, {});
  const ExampleColours colours(image, shaft, {});
  const cv::Mat unknown(image.rows / 4, image.cols / 4, CV_32F, cv::Scalar(0.3));
  ASSERT_GT(overlap(follow_edges(image, colours.counted_in(image, unknown)) >= 128, dots | truth), 0.7);
  finder.use(colours);
  const cv::Mat mask = finder.find(image).mask;
  EXPECT_EQ(cv::countNonZero(mask & dots), 0);
  EXPECT_GT(overlap(mask, truth), 0.8);
}

}  // namespace
}  // namespace palpate
