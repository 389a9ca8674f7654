#include <gtest/gtest.h>

#include "palpate/instrument/instrument_tracker.h"
#include "palpate/instrument/segment.h"
#include "tests/instrument/rendered_scene.h"

namespace palpate {
namespace {

using Look = SimulatedInstrument::Look;

struct Kind {
  const char* name;
  test::Tissue tissue;
  Look look;
  double min_overlap;  ///< intersection over union
  double max_wrong_mm;
};

SimulatedInstrument instrument_of(const Kind& kind) {
  SimulatedInstrument instrument;
  instrument.look = kind.look;
  if (kind.look == Look::blue_tube) instrument.model = SimulatedInstrument::Model::probe;
  if (kind.look != Look::white_ceramic) instrument.enters_from = {-120, 60, 10};
  return instrument;
}

class Kinds : public ::testing::TestWithParam<Kind> {};

TEST_P(Kinds, AreSegmentedAndFollowedAndTissueThatMovesIsNone) {
  const Kind& kind = GetParam();
  test::RenderedScene scene(kind.tissue, {instrument_of(kind)});
  const RectifiedPair first = scene.draw({}, 0);
  const SegmentationModel model = learn_segmentation(first.left, {});
  EXPECT_EQ(cv::countNonZero(model.reference_mask), 0);
  EXPECT_EQ(cv::countNonZero(segment_instrument(scene.draw({}, 1, {0.5, 1, -1}).left, model)), 0);

  InstrumentTracker tracker({}, scene.rectification(), first, {});
  for (int frame = 2; frame < 4; ++frame) {
    const Vec3 tip_mm(4 - 2 * frame, 2 + frame, 78);
    const RectifiedPair pair = scene.draw({tip_mm}, frame);
    const cv::Mat truth = scene.truth_mask(0, 0), found = segment_instrument(pair.left, model);
    const double overlap = 1.0 * cv::countNonZero(found & truth) / std::max(1, cv::countNonZero(found | truth));
    EXPECT_GT(overlap, kind.min_overlap) << "frame " << frame;
    const InstrumentObservations seen = tracker.update(pair);
    ASSERT_TRUE(seen.tips[0].visible) << "frame " << frame;
    EXPECT_FALSE(seen.tips[1].visible);
    EXPECT_LT((seen.tips[0].tip_mm - tip_mm).norm(), kind.max_wrong_mm) << "frame " << frame;
  }
}

INSTANTIATE_TEST_SUITE_P(Rendered, Kinds,
                         ::testing::Values(Kind{"DarkOnRed", test::Tissue::red, Look::dark_ribbed, 0.85, 3},
                                           Kind{"BlueTubeOnFat", test::Tissue::fat, Look::blue_tube, 0.85, 1.5},
                                           Kind{"CeramicOnTendon", test::Tissue::tendon, Look::white_ceramic, 0.85, 3},
                                           Kind{"SteelOnPale", test::Tissue::pale, Look::steel, 0.85, 2},
                                           Kind{"SteelOnBrown", test::Tissue::brown, Look::steel, 0.85, 2}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace palpate
