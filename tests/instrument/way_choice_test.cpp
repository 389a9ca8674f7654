#include "palpate/instrument/way_choice.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

const cv::Size kSize(640, 360);
const std::vector<cv::Mat> kAreas(2, cv::Mat(kSize, CV_8U, cv::Scalar(255)));

FoundInstruments nothing() {
  return {cv::Mat::zeros(kSize, CV_8U), {}, {}};
}

/// A shaft that enters from the left at `y_px` and ends at (300 + right_px, y_px + 40).
FoundInstruments shaft(int y_px, int right_px = 0) {
  FoundInstruments found = nothing();
  cv::line(found.mask, {0, y_px}, {300 + right_px, y_px + 40}, 255, 30);
  return found;
}

/// Left and right, one tip.
std::vector<FoundInstruments> pair_of(int y_px) {
  return {shaft(y_px, 20), shaft(y_px)};
}

std::vector<BothWays> both(const std::vector<FoundInstruments>& by_colours,
                           const std::vector<FoundInstruments>& by_network) {
  return {{by_colours[0], by_network[0]}, {by_colours[1], by_network[1]}};
}

const std::vector<FoundInstruments> kNothing{nothing(), nothing()};

TEST(WayChoice, TheColoursDrawWhileTheNetworkFindsTheSame) {
  WayChoice way;
  way.compare(both(pair_of(100), pair_of(104)), kAreas);
  EXPECT_TRUE(way.by_colours());
}

TEST(WayChoice, TheNetworkDrawsWhereTheColoursFindNothingOrSomethingElse) {
  WayChoice blind, elsewhere;
  blind.compare(both(kNothing, pair_of(100)), kAreas);
  EXPECT_FALSE(blind.by_colours());
  elsewhere.compare(both(pair_of(250), pair_of(100)), kAreas);
  EXPECT_FALSE(elsewhere.by_colours());
}

TEST(WayChoice, TheColoursDrawWhereTheNetworkFindsNothing) {
  WayChoice way;
  way.compare(both(pair_of(100), kNothing), kAreas);
  EXPECT_TRUE(way.by_colours());
}

TEST(WayChoice, TheWayStaysDuringAContactWhileItShowsAnInstrument) {
  WayChoice way;
  way.compare(both(pair_of(100), pair_of(100)), kAreas);
  way.keep(true);
  for (int frame = 0; frame < 5; ++frame) way.compare(both(pair_of(250), pair_of(100)), kAreas);
  EXPECT_TRUE(way.by_colours());
  way.compare(both(kNothing, pair_of(100)), kAreas);
  EXPECT_FALSE(way.by_colours());
}

TEST(WayChoice, WhatCannotBeOneTipInBothCamerasIsNotSeen) {
  WayChoice way;
  way.compare(both({shaft(100), shaft(250)}, pair_of(100)), kAreas);
  EXPECT_FALSE(way.by_colours());
}

TEST(WayChoice, OneCameraIsEnoughWhereThereIsOneOnly) {
  WayChoice way;
  way.compare({{nothing(), shaft(100)}}, {kAreas[0]});
  EXPECT_FALSE(way.by_colours());
}

TEST(WayChoice, BothWaysLookUntilTheyCanBeComparedAndThenInOneFrameOfFive) {
  WayChoice way;
  way.compare(both(kNothing, kNothing), kAreas);
  EXPECT_TRUE(way.compares());
  way.compare(both(pair_of(100), pair_of(100)), kAreas);
  int alone = 0;
  while (!way.compares()) {
    EXPECT_TRUE(way.suffices(pair_of(100)));
    ++alone;
  }
  EXPECT_EQ(alone, 4);
}

TEST(WayChoice, BothWaysLookWhenWhatWasThereIsMissing) {
  WayChoice way;
  way.compare(both(pair_of(100), pair_of(100)), kAreas);
  EXPECT_FALSE(way.suffices(kNothing));
  EXPECT_TRUE(way.suffices(kNothing)) << "it has left";
}

}  // namespace
}  // namespace palpate
