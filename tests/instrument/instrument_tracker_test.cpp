#include "palpate/instrument/instrument_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "tests/instrument/drawn_scene.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

TEST(InstrumentTracker, FollowsADrawnInstrument) {
  test::DrawnInstrument instrument;
  const Vec3 start = instrument.tip_mm;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 10; ++frame) {
    instrument.tip_mm = start + Vec3(-1.0, 0.3, 0.4) * frame;
    const auto seen = tracker.update(test::draw_pair({}, instrument, frame)).tips[0];
    ASSERT_TRUE(seen.visible) << "frame " << frame;
    const Vec3 error = seen.tip_mm - instrument.tip_mm;
    EXPECT_LT(error.head<2>().norm(), 0.6) << "frame " << frame;
    EXPECT_LT(std::abs(error.z()), 1.2) << "frame " << frame;
    if (frame > 2) {
      EXPECT_LT((seen.velocity_mm_per_s - Vec3(-25, 7.5, 10)).norm(), 8) << "frame " << frame;
    }
  }
}

TEST(InstrumentTracker, KnowsTheDepthOfASteepShaftThatComesInFast) {
  test::DrawnInstrument instrument;
  instrument.direction = Vec3(-0.6, -0.2, 0.75).normalized();
  const Vec3 end_mm = instrument.tip_mm;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 14; ++frame) {
    instrument.tip_mm = end_mm - 5.0 * std::max(0, 9 - frame) * instrument.direction;
    const auto seen = tracker.update(test::draw_pair({}, instrument, frame)).tips[0];
    if (frame < 9) continue;
    ASSERT_TRUE(seen.visible) << "frame " << frame;
    EXPECT_LT(std::abs(seen.tip_mm.z() - instrument.tip_mm.z()), 1.5) << "frame " << frame;
  }
}

TEST(InstrumentTracker, MeasuresTheDisplacementSinceTheMarkMuchBetterThanTheTip) {
  test::DrawnInstrument instrument;
  const Vec3 start = instrument.tip_mm;
  const Vec3 direction = instrument.direction;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 4; ++frame) tracker.update(test::draw_pair({}, instrument, frame));
  tracker.mark(0);
  int frame = 4;
  for (const Vec3& moved : {Vec3(0, 0, 0), Vec3(0.4, 0, -0.8), Vec3(1, 0.5, -2), Vec3(1.5, 1, -3.5), Vec3(0, 0, 2)}) {
    instrument.tip_mm = start + moved;
    // A little turn about the tip must not be taken for a displacement of it.
    instrument.direction = (direction + 0.004 * moved.norm() * Vec3(0, 1, 0)).normalized();
    const auto seen = tracker.update(test::draw_pair({}, instrument, frame++)).tips[0];
    ASSERT_TRUE(seen.since_mark_mm);
    const Vec3 error = *seen.since_mark_mm - moved;
    EXPECT_LT(error.head<2>().norm(), 0.1) << "moved by " << moved.transpose();
    EXPECT_LT(std::abs(error.z()), 0.3) << "moved by " << moved.transpose();
  }
  tracker.unmark(0);
  EXPECT_FALSE(tracker.update(test::draw_pair({}, instrument, frame)).tips[0].since_mark_mm);
}

/// A frame of an instrument on whose shaft a strip of gauze has come to lie, from border to border: the mask of both
/// together is no instrument any more, while the jaws look as before.
RectifiedPair draw_with_gauze(const test::DrawnInstrument& instrument, int index) {
  RectifiedPair pair = test::draw_pair({}, instrument, index);
  for (cv::Mat* image : {&pair.left, &pair.right})
    cv::rectangle(*image, cv::Rect(image->cols - 100, 0, 40, image->rows), cv::Scalar::all(180), cv::FILLED);
  return pair;
}

TEST(InstrumentTracker, FollowsAHeldInstrumentByItsTextureWhereTheMaskShowsNone) {
  test::DrawnInstrument instrument;
  const Vec3 start = instrument.tip_mm;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 4; ++frame) tracker.update(test::draw_pair({}, instrument, frame));
  tracker.mark(0);
  for (int frame = 4; frame < 14; ++frame) {
    const Vec3 moved = (frame - 3) * Vec3(-0.1, 0.05, 0.1);
    instrument.tip_mm = start + moved;
    const auto seen = tracker.update(draw_with_gauze(instrument, frame)).tips[0];
    ASSERT_TRUE(seen.visible) << "frame " << frame;
    ASSERT_TRUE(seen.since_mark_mm) << "frame " << frame;
    EXPECT_LT((*seen.since_mark_mm - moved).norm(), 0.3) << "frame " << frame;
  }
  int last_seen = 0;
  for (int frame = 14; frame < 20; ++frame)
    if (tracker.update(test::draw_pair({.instrument = false}, {}, frame)).tips[0].visible) last_seen = frame;
  EXPECT_LT(last_seen, 19);
}

TEST(InstrumentTracker, AHeldTipStaysWhereItIsWhenTissueCoversTheEndOfItsMask) {
  const test::DrawnInstrument instrument;
  const Rectification rectification = test::drawn_rectification();
  InstrumentTracker tracker({}, rectification, test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 4; ++frame) tracker.update(test::draw_pair({}, instrument, frame));
  tracker.mark(0);
  for (int frame = 4; frame < 12; ++frame) {
    RectifiedPair pair = test::draw_pair({}, instrument, frame);
    const cv::Point2d at = project_to_rectified(rectification, instrument.tip_mm);
    const cv::Point2d in_right = at - cv::Point2d(rectification.disparity_px(instrument.tip_mm.z()), 0);
    cv::circle(pair.left, at, 18, cv::Scalar(48, 52, 135), cv::FILLED);
    cv::circle(pair.right, in_right, 18, cv::Scalar(48, 52, 135), cv::FILLED);
    const auto seen = tracker.update(pair).tips[0];
    ASSERT_TRUE(seen.visible) << "frame " << frame;
    EXPECT_LT((seen.tip_mm - instrument.tip_mm).norm(), 1.5) << "frame " << frame;
    ASSERT_TRUE(seen.since_mark_mm) << "frame " << frame;
    EXPECT_LT(seen.since_mark_mm->norm(), 0.3) << "frame " << frame;
  }
}

TEST(InstrumentTracker, LosesAFreeInstrumentWhoseMaskIsGone) {
  const test::DrawnInstrument instrument;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 4; ++frame) tracker.update(test::draw_pair({}, instrument, frame));
  int last_seen = 0;
  for (int frame = 4; frame < 12; ++frame)
    if (tracker.update(draw_with_gauze(instrument, frame)).tips[0].visible) last_seen = frame;
  EXPECT_LT(last_seen, 9);
}

TEST(InstrumentTracker, LosesAnInstrumentThatLeavesAndFindsItAgain) {
  const test::DrawnInstrument instrument;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  EXPECT_FALSE(tracker.update(test::draw_pair({.instrument = false}, {}, 0)).tips[0].visible);
  EXPECT_TRUE(tracker.update(test::draw_pair({}, instrument, 1)).tips[0].visible);
  EXPECT_TRUE(tracker.update(test::draw_pair({}, instrument, 2)).tips[0].visible);
  tracker.mark(0);
  for (int frame = 3; frame < 6; ++frame) {
    const auto seen = tracker.update(test::draw_pair({.instrument = false}, {}, frame)).tips[0];
    EXPECT_FALSE(seen.visible);
    EXPECT_FALSE(seen.since_mark_mm);
  }
  test::DrawnInstrument elsewhere = instrument;
  elsewhere.tip_mm += Vec3(6, -8, -4);
  int found = 0;
  for (int frame = 6; frame < 9; ++frame) {
    const auto seen = tracker.update(test::draw_pair({}, elsewhere, frame)).tips[0];
    if (!seen.visible) continue;
    ++found;
    EXPECT_LT((seen.tip_mm - elsewhere.tip_mm).norm(), 1.5);
  }
  EXPECT_GE(found, 1);
}

TEST(InstrumentTracker, SeesAnInstrumentOfTheStaticFrameLeaveAndComeBackElsewhere) {
  const test::DrawnInstrument instrument;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({}, instrument, 0), {});
  EXPECT_TRUE(tracker.update(test::draw_pair({}, instrument, 1)).tips[0].visible);
  EXPECT_FALSE(tracker.update(test::draw_pair({.instrument = false}, {}, 2)).tips[0].visible);
  const test::DrawnInstrument elsewhere{.tip_mm = {-10, -6, 84}, .direction = Vec3(0.8, 0.3, 0.4).normalized()};
  for (int frame = 3; frame < 6; ++frame) {
    const auto seen = tracker.update(test::draw_pair({}, elsewhere, frame)).tips[0];
    ASSERT_TRUE(seen.visible) << "frame " << frame;
    EXPECT_LT((seen.tip_mm - elsewhere.tip_mm).norm(), 1.5) << "frame " << frame;
  }
}

TEST(InstrumentTracker, SaysNothingOnBlackFramesAndGoesOnAfterwards) {
  const test::DrawnInstrument instrument;
  InstrumentTracker tracker({}, test::drawn_rectification(), test::draw_pair({}, instrument, 0), {});
  EXPECT_TRUE(tracker.update(test::draw_pair({}, instrument, 0)).tips[0].visible);
  EXPECT_TRUE(tracker.update(test::draw_pair({}, instrument, 1)).tips[0].visible);
  RectifiedPair black = test::draw_pair({}, instrument, 2);
  black.left.setTo(0);
  black.right.setTo(0);
  EXPECT_FALSE(tracker.update(black).tips[0].visible);
  const auto seen = tracker.update(test::draw_pair({}, instrument, 3)).tips[0];
  EXPECT_TRUE(seen.visible);
  EXPECT_LT((seen.tip_mm - instrument.tip_mm).norm(), 1.5);
}

TEST(InstrumentTracker, SeesNoInstrumentInHighlights) {
  InstrumentTracker tracker({}, test::drawn_rectification(),
                            test::draw_pair({.instrument = false, .highlights = true}, {}, 0), {});
  for (int frame = 0; frame < 5; ++frame) {
    const test::DrawnScene scene{.instrument = false, .highlights = true, .highlight_shift_px = 4.0 * frame};
    EXPECT_FALSE(tracker.update(test::draw_pair(scene, {}, frame)).tips[0].visible);
  }
}

/// One of the rendered sequences of the reference data: 960x540, rectified, with the tip of every frame.
struct Rendered {
  std::vector<RectifiedPair> pairs;
  std::vector<Vec3> tip_mm;
};

Rendered read_rendered(const std::string& name) {
  const auto folder = test::reference_data() / name;
  Rendered sequence;
  cv::VideoCapture left((folder / "left.mp4").string()), right((folder / "right.mp4").string());
  RectifiedPair pair;
  while (left.read(pair.left) && right.read(pair.right)) {
    sequence.pairs.push_back({pair.index, 0.04 * pair.index, pair.left.clone(), pair.right.clone()});
    ++pair.index;
  }
  std::ifstream truth(folder / "truth.csv");
  std::string line;
  std::getline(truth, line);
  while (std::getline(truth, line)) {
    std::stringstream cells(line);
    std::vector<double> values;
    for (std::string cell; std::getline(cells, cell, ',');) values.push_back(std::stod(cell));
    sequence.tip_mm.push_back({values.at(7), values.at(8), values.at(9)});
  }
  return sequence;
}

Rectification rendered_rectification() {
  Rectification rectification;
  rectification.size = {960, 540};
  rectification.focal_px = 700;
  rectification.principal_x_px = 479.5;
  rectification.principal_y_px = 269.5;
  rectification.baseline_mm = 5;
  rectification.identity = true;
  return rectification;
}

class RenderedTip : public ::testing::TestWithParam<const char*> {};

TEST_P(RenderedTip, IsFollowedThroughTheWholeSequence) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  const Rendered sequence = read_rendered(GetParam());
  ASSERT_EQ(sequence.pairs.size(), sequence.tip_mm.size());
  const int first_contact = 15, last_contact = 89;

  InstrumentTracker tracker({}, rendered_rectification(), sequence.pairs[0], {});
  int visible = 0, marked = 0;
  Vec3 tip_squares = Vec3::Zero(), marked_squares = Vec3::Zero();
  double consistency = 0;
  for (size_t i = 0; i < sequence.pairs.size(); ++i) {
    const auto seen = tracker.update(sequence.pairs[i]).tips[0];
    const int frame = static_cast<int>(i);
    if (seen.visible) {
      const Vec3 error = seen.tip_mm - sequence.tip_mm[i];
      tip_squares += error.cwiseAbs2();
      consistency += error.dot(seen.covariance_mm2.ldlt().solve(error));
      ++visible;
    }
    if (seen.since_mark_mm) {
      const Vec3 error = *seen.since_mark_mm - (sequence.tip_mm[i] - sequence.tip_mm[first_contact]);
      marked_squares += error.cwiseAbs2();
      ++marked;
    }
    if (frame == first_contact) tracker.mark(0);
    if (frame == last_contact) tracker.unmark(0);
  }
  EXPECT_GE(visible, 95);
  const Vec3 tip_rmse = (tip_squares / visible).cwiseSqrt();
  EXPECT_LT(tip_rmse.maxCoeff(), 0.8) << tip_rmse.transpose();
  EXPECT_LT(consistency / visible, 12) << "the covariance is too small";
  ASSERT_EQ(marked, last_contact - first_contact);
  const Vec3 marked_rms = (marked_squares / marked).cwiseSqrt();
  EXPECT_LT(marked_rms.head<2>().norm(), 0.05) << marked_rms.transpose();
  EXPECT_LT(marked_rms.z(), 0.145) << marked_rms.transpose();
}

INSTANTIATE_TEST_SUITE_P(Reference, RenderedTip, ::testing::Values("rendered_uterus", "rendered_liver"));

TEST(InstrumentTracker, SeesNoInstrumentOnRealTissueWithoutOne) {
  PALPATE_NEEDS_REFERENCE("surgt_tissue");
  const auto folder = test::reference_data() / "surgt_tissue";
  cv::VideoCapture video((folder / "video.mp4").string());
  const Rectification rectification = make_rectification(read_rig(folder / "calibration.yaml"), {1280, 1024});
  std::unique_ptr<InstrumentTracker> tracker;
  cv::Mat both;
  int frames = 0;
  for (; video.read(both); ++frames) {
    StereoFrame frame;
    frame.index = frames;
    frame.time_s = 0.04 * frames;
    frame.left = both.colRange(0, 1280).clone();
    frame.right = both.colRange(1280, 2560).clone();
    const RectifiedPair pair = rectify(rectification, frame);
    if (!tracker) tracker = std::make_unique<InstrumentTracker>(InstrumentOptions{}, rectification, pair, cv::Mat());
    EXPECT_FALSE(tracker->update(pair).tips[0].visible) << "frame " << frames;
  }
  EXPECT_EQ(frames, 10);
}

TEST(InstrumentTracker, SeesNoInstrumentOnASiliconeHeart) {
  PALPATE_NEEDS_REFERENCE("hamlyn_heart");
  const auto folder = test::reference_data() / "hamlyn_heart";
  RectifiedPair pair;
  pair.left = cv::imread((folder / "f7_dynamic_deint_L_0100.png").string());
  pair.right = cv::imread((folder / "f7_dynamic_deint_R_0100.png").string());
  Rectification rectification;
  rectification.size = pair.left.size();
  rectification.focal_px = 390;
  rectification.principal_x_px = 180;
  rectification.principal_y_px = 144;
  rectification.baseline_mm = 5.5;
  InstrumentTracker tracker({}, rectification, pair, {});
  EXPECT_FALSE(tracker.update(pair).tips[0].visible);
}

}  // namespace
}  // namespace palpate
