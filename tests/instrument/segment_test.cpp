#include "palpate/instrument/segment.h"

#include <gtest/gtest.h>

#include "tests/instrument/drawn_scene.h"

namespace palpate {
namespace {

double overlap(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

TEST(Segment, CoversTheDrawnInstrument) {
  const test::DrawnInstrument instrument;
  const auto empty = test::draw_pair({.instrument = false}, instrument, 0);
  const auto model = learn_segmentation(empty.left, {});
  const auto pair = test::draw_pair({}, instrument, 1);
  EXPECT_GT(overlap(segment_instrument(pair.left, model), test::drawn_mask(instrument)), 0.95);
}

TEST(Segment, SeesAnInstrumentThatIsInTheStaticFrameAlready) {
  const test::DrawnInstrument instrument;
  const auto pair = test::draw_pair({}, instrument, 0);
  const auto model = learn_segmentation(pair.left, {});
  EXPECT_GT(overlap(model.reference_mask, test::drawn_mask(instrument)), 0.95);
  EXPECT_GT(overlap(segment_instrument(pair.left, model), test::drawn_mask(instrument)), 0.95);
}

TEST(Segment, SeesTheWholeShaftWhereItsEndStoodAtTheBorderInTheStaticFrame) {
  test::DrawnInstrument instrument;
  const Vec3 inside_mm = instrument.tip_mm;
  for (const double back_mm : {42.0, 44.0, 46.0}) {
    instrument.tip_mm = inside_mm - back_mm * instrument.direction;
    const auto model = learn_segmentation(test::draw_pair({}, instrument, 0).left, {});
    instrument.tip_mm = inside_mm;
    const cv::Mat seen = segment_instrument(test::draw_pair({}, instrument, 1).left, model);
    EXPECT_GT(overlap(seen, test::drawn_mask(instrument)), 0.9) << back_mm << " mm back in the static frame";
  }
}

TEST(Segment, FindsNothingOnTissue) {
  const auto empty = test::draw_pair({.instrument = false}, {}, 0);
  const auto model = learn_segmentation(empty.left, {});
  EXPECT_EQ(cv::countNonZero(model.reference_mask), 0);
  EXPECT_EQ(cv::countNonZero(segment_instrument(test::draw_pair({.instrument = false}, {}, 1).left, model)), 0);
}

TEST(Segment, LeavesOutHighlightsEvenWhenTheyMove) {
  const auto first = test::draw_pair({.instrument = false, .highlights = true}, {}, 0);
  const auto model = learn_segmentation(first.left, {});
  for (double shift : {0.0, 6.0, 25.0}) {
    const auto pair = test::draw_pair({.instrument = false, .highlights = true, .highlight_shift_px = shift}, {}, 1);
    EXPECT_EQ(cv::countNonZero(segment_instrument(pair.left, model)), 0) << "shift " << shift;
  }
}

TEST(Segment, FindsNothingInABlackOrWhiteImage) {
  const auto model = learn_segmentation(test::draw_pair({.instrument = false}, {}, 0).left, {});
  EXPECT_EQ(cv::countNonZero(segment_instrument(cv::Mat(360, 640, CV_8UC3, cv::Scalar::all(0)), model)), 0);
  EXPECT_EQ(cv::countNonZero(segment_instrument(cv::Mat(360, 640, CV_8UC3, cv::Scalar::all(255)), model)), 0);
}

}  // namespace
}  // namespace palpate
