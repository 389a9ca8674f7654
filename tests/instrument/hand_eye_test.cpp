#include "palpate/instrument/hand_eye.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

/// Where the tip of the tests is at a moment of the video, left camera frame.
Vec3 path_mm(double t) {
  return {12 * std::sin(1.7 * t), 8 * std::sin(2.3 * t + 1), 95 + 6 * std::sin(1.1 * t)};
}

const CameraFromRobot kTruth{Eigen::AngleAxisd(2.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix(), {30, -80, 410}};
constexpr double kOffset_s = 3.137;

/// The same path at 100 Hz as the robot writes it down.
TipTrack robot_track(double first_s, double last_s) {
  TipTrack track;
  for (int row = 0; first_s + 0.01 * row <= last_s; ++row) {
    const double video_s = first_s + 0.01 * row;
    track.rows[row] = {video_s + kOffset_s, kTruth.rotation.transpose() * (path_mm(video_s) - kTruth.translation_mm),
                       std::nullopt};
  }
  return track;
}

std::vector<SeenTip> seen_tips(int frames, double across_mm, double along_mm, int every_wrong) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<SeenTip> seen;
  for (int frame = 0; frame < frames; ++frame) {
    Vec3 tip = path_mm(0.04 * frame);
    tip += Vec3(across_mm * normal(random), across_mm * normal(random), along_mm * normal(random));
    if (every_wrong > 0 && frame % every_wrong == 0) tip += Vec3(25, -10, 30);
    seen.push_back({0.04 * frame, tip});
  }
  return seen;
}

double angle_deg(const Mat3& a, const Mat3& b) {
  return 180 / std::numbers::pi * Eigen::AngleAxisd(a * b.transpose()).angle();
}

TEST(HandEye, FindsAxesAndClockExactlyWhereTheVideoIsExact) {
  const HandEye found = estimate_hand_eye(seen_tips(100, 0, 0, 0), robot_track(-1, 6));
  EXPECT_NEAR(found.time_offset_s, kOffset_s, 1e-3);
  EXPECT_LT(angle_deg(found.camera_from_robot.rotation, kTruth.rotation), 0.05);
  EXPECT_LT(found.rms_mm, 0.05);
  EXPECT_EQ(found.frames, 100);
}

TEST(HandEye, IsNotLedAstrayByNoiseAndFramesInWhichSomethingElseWasTakenForTheTip) {
  const HandEye found = estimate_hand_eye(seen_tips(120, 0.3, 0.8, 8), robot_track(-1, 6));
  EXPECT_NEAR(found.time_offset_s, kOffset_s, 0.01);
  EXPECT_LT(angle_deg(found.camera_from_robot.rotation, kTruth.rotation), 1.5);
  double squared = 0;
  for (int frame = 0; frame < 120; ++frame) {
    const Vec3 truth = path_mm(0.04 * frame);
    const Vec3 in_robot = kTruth.rotation.transpose() * (truth - kTruth.translation_mm);
    squared += (found.camera_from_robot(in_robot) - truth).squaredNorm();
  }
  EXPECT_LT(std::sqrt(squared / 120), 0.3);
  EXPECT_LE(found.frames, 120 - 120 / 8);
  EXPECT_GT(found.deviation_deg, 0.3);
  EXPECT_LT(found.deviation_deg, 3);
}

TEST(HandEye, SaysWhenAStraightPathLeavesTheRotationOpen) {
  std::vector<SeenTip> seen;
  TipTrack track;
  for (int frame = 0; frame < 60; ++frame) {
    const Vec3 tip(10 * std::sin(0.1 * frame), 0, 100);
    seen.push_back({0.04 * frame, tip});
    track.rows[frame] = {0.04 * frame, tip, std::nullopt};
  }
  EXPECT_THROW(estimate_hand_eye(seen, track), BadInput);
}

TEST(HandEye, SaysWhenTrackAndVideoHardlyOverlapOrNothingIsSeen) {
  EXPECT_THROW(estimate_hand_eye(seen_tips(100, 0, 0, 0), robot_track(0, 0.5)), BadInput);
  EXPECT_THROW(estimate_hand_eye(seen_tips(5, 0, 0, 0), robot_track(0, 6)), BadInput);
}

TEST(TrackOnAnotherClock, IsReadBetweenItsRowsAndNowhereElse) {
  TipTrack track;
  track.rows[0] = {1.0, {0, 0, 100}, true};
  track.rows[1] = {1.05, {1, 0, 100}, false};
  track.rows[2] = {1.5, {2, 0, 100}, false};
  EXPECT_FALSE(row_at(track, 0.99));
  EXPECT_NEAR(row_at(track, 1.01)->tip_mm.x(), 0.2, 1e-12);
  EXPECT_TRUE(*row_at(track, 1.01)->closed);
  EXPECT_FALSE(*row_at(track, 1.04)->closed);
  EXPECT_FALSE(row_at(track, 1.3)) << "half a second without rows";
  EXPECT_TRUE(row_at(track, 1.5));
  EXPECT_FALSE(row_at(track, 1.51));
}

TEST(TrackInRobotAxes, ComesToWhereTheCameraSeesIt) {
  TipTrack track;
  track.rows[4] = {0.2, {1, 2, 3}, std::nullopt};
  CameraFromRobot turned;
  turned.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  turned.translation_mm = {10, 20, 30};
  EXPECT_LT((in_camera(track, turned).rows.at(4).tip_mm - Vec3(8, 21, 33)).norm(), 1e-12);
}

}  // namespace
}  // namespace palpate
