#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "palpate/core/errors.h"
#include "palpate/instrument/instrument_tracker.h"
#include "tests/instrument/drawn_scene.h"

namespace palpate {
namespace {

const test::DrawnInstrument kFromTheRight{.tip_mm = {8, -4, 82}, .radius_mm = 3.2};
const test::DrawnInstrument kFromTheLeft{
    .tip_mm = {-12, 8, 80}, .direction = Vec3(0.8, 0.25, 0.5).normalized(), .radius_mm = 2.4};

test::DrawnInstrument moved(test::DrawnInstrument instrument, const Vec3& by_mm) {
  instrument.tip_mm += by_mm;
  return instrument;
}

InstrumentTracker tracker_of_empty_scene() {
  return InstrumentTracker({}, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
}

/// No tip that is visible may be far from the instrument that it stands for.
void expect_near(const TipObservation& seen, const test::DrawnInstrument& truth, int frame, const char* name) {
  if (!seen.visible) return;
  EXPECT_LT((seen.tip_mm - truth.tip_mm).norm(), 1.5) << name << ", frame " << frame;
}

TEST(TwoInstruments, HaveEntriesOfTheirOwnInTheOrderInWhichTheyCame) {
  InstrumentTracker tracker = tracker_of_empty_scene();
  int second_visible = 0;
  for (int frame = 1; frame < 14; ++frame) {
    const auto first = moved(kFromTheLeft, Vec3(0.5, -0.2, 0.2) * frame);
    const auto second = moved(kFromTheRight, Vec3(-0.4, 0.2, -0.2) * frame);
    std::vector<test::DrawnInstrument> drawn = {first};
    if (frame > 3) drawn.push_back(second);
    const auto seen = tracker.update(test::draw_pair_of(drawn, {}, frame)).tips;
    ASSERT_EQ(seen.size(), kMaxInstruments);
    EXPECT_TRUE(seen[0].visible) << "frame " << frame;
    expect_near(seen[0], first, frame, "first");
    expect_near(seen[1], second, frame, "second");
    second_visible += seen[1].visible;
  }
  EXPECT_GE(second_visible, 8);
}

TEST(TwoInstruments, AtTheSameTimeTheOneThatCoversMoreIsTheFirst) {
  InstrumentTracker tracker = tracker_of_empty_scene();
  for (int frame = 1; frame < 6; ++frame) {
    const auto seen = tracker.update(test::draw_pair_of(std::vector{kFromTheLeft, kFromTheRight}, {}, frame)).tips;
    EXPECT_TRUE(seen[0].visible);
    expect_near(seen[0], kFromTheRight, frame, "first");
    expect_near(seen[1], kFromTheLeft, frame, "second");
  }
}

TEST(TwoInstruments, KeepTheirEntriesWhenOneLeavesAndComesBack) {
  InstrumentTracker tracker = tracker_of_empty_scene();
  for (int frame = 1; frame < 12; ++frame)
    tracker.update(test::draw_pair_of(std::vector{kFromTheRight, kFromTheLeft}, {}, frame));
  for (int frame = 12; frame < 15; ++frame) {
    const auto seen = tracker.update(test::draw_pair({}, kFromTheLeft, frame)).tips;
    EXPECT_FALSE(seen[0].visible);
    EXPECT_TRUE(seen[1].visible);
    expect_near(seen[1], kFromTheLeft, frame, "second");
  }
  for (int frame = 15; frame < 17; ++frame) tracker.update(test::draw_pair({.instrument = false}, {}, frame));
  const auto back = moved(kFromTheRight, {3, 5, 0});
  for (int frame = 17; frame < 19; ++frame) {
    const auto seen = tracker.update(test::draw_pair({}, back, frame)).tips;
    EXPECT_TRUE(seen[0].visible);
    EXPECT_FALSE(seen[1].visible);
    expect_near(seen[0], back, frame, "first");
  }
}

TEST(TwoInstruments, AreMarkedApart) {
  InstrumentTracker tracker = tracker_of_empty_scene();
  for (int frame = 1; frame < 7; ++frame)
    tracker.update(test::draw_pair_of(std::vector{kFromTheRight, kFromTheLeft}, {}, frame));
  tracker.mark(1);
  const Vec3 by_mm(1, -0.5, -1.5);
  const auto seen =
      tracker.update(test::draw_pair_of(std::vector{kFromTheRight, moved(kFromTheLeft, by_mm)}, {}, 7)).tips;
  EXPECT_FALSE(seen[0].since_mark_mm);
  ASSERT_TRUE(seen[1].since_mark_mm);
  EXPECT_LT((*seen[1].since_mark_mm - by_mm).norm(), 0.35);
}

TEST(TwoInstruments, GiveNoWrongTipWhereTheyCross) {
  InstrumentTracker tracker = tracker_of_empty_scene();
  int visible = 0, touching = 0;
  for (int frame = 1; frame < 24; ++frame) {
    // The left one moves on until its tip has gone past the right one's shaft, in front of it, and back.
    const double fraction = 0.5 - 0.5 * std::cos(2 * CV_PI * frame / 24);
    const auto left = moved(kFromTheLeft, fraction * Vec3(33, -5, -10));
    const auto seen = tracker.update(test::draw_pair_of(std::vector{kFromTheRight, left}, {}, frame)).tips;
    expect_near(seen[0], kFromTheRight, frame, "first");
    expect_near(seen[1], left, frame, "second");
    if (cv::countNonZero(test::drawn_mask(left) & test::drawn_mask(kFromTheRight)) == 0) continue;
    ++touching;
    visible += seen[0].visible + seen[1].visible;
  }
  EXPECT_GE(touching, 4);
  EXPECT_GE(visible, touching) << "followed by their texture less than half of the time";
}

TEST(TwoInstruments, TouchingFromTheFirstFrameAreNotTakenForOne) {
  const test::DrawnInstrument from_the_left{.tip_mm = kFromTheRight.tip_mm,
                                            .direction = Vec3(0.8, 0.2, 0.5).normalized()};
  InstrumentTracker tracker = tracker_of_empty_scene();
  for (int frame = 1; frame < 5; ++frame)
    for (const TipObservation& tip :
         tracker.update(test::draw_pair_of(std::vector{kFromTheRight, from_the_left}, {}, frame)).tips)
      expect_near(tip, kFromTheRight, frame, "tip");
}

TEST(TwoInstruments, ThatTouchedInTheStaticFrameAreSeenWhenOneComesBackWhereItStood) {
  const test::DrawnInstrument from_the_left{.tip_mm = kFromTheRight.tip_mm,
                                            .direction = Vec3(0.8, 0.2, 0.5).normalized()};
  InstrumentTracker tracker({}, test::drawn_rectification(),
                            test::draw_pair_of(std::vector{kFromTheRight, from_the_left}, {}, 0), {});
  int frame = 1;
  for (; frame < 4; ++frame)
    EXPECT_FALSE(tracker.update(test::draw_pair({.instrument = false}, {}, frame)).tips[0].visible);
  for (; frame < 8; ++frame) {
    const auto seen = tracker.update(test::draw_pair({}, kFromTheRight, frame)).tips;
    ASSERT_TRUE(seen[0].visible) << "frame " << frame;
    expect_near(seen[0], kFromTheRight, frame, "tip");
  }
}

TEST(TwoInstruments, ComeFromTwoTipTracks) {
  const auto folder = std::filesystem::temp_directory_path();
  InstrumentOptions options;
  options.track = folder / "palpate_two_instruments_1.csv";
  options.track_2 = folder / "palpate_two_instruments_2.csv";
  std::ofstream(options.track) << "frame,time_s,x_mm,y_mm,z_mm\n0,0,1,2,80\n1,0.04,1,2,81\n";
  std::ofstream(options.track_2) << "frame,time_s,x_mm,y_mm,z_mm\n1,0.04,-5,2,90\n";
  RectifiedPair pair = test::draw_pair({.instrument = false}, {}, 0);
  InstrumentTracker tracker(options, test::drawn_rectification(), pair, {});
  EXPECT_FALSE(tracker.update(pair).tips[1].visible);
  pair.index = 1;
  const auto seen = tracker.update(pair).tips;
  EXPECT_EQ(seen[0].tip_mm, Vec3(1, 2, 81));
  EXPECT_EQ(seen[1].tip_mm, Vec3(-5, 2, 90));
  for (const auto& file : {options.track, options.track_2}) std::filesystem::remove(file);
}

}  // namespace
}  // namespace palpate
