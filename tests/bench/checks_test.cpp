#include "bench/accuracy/checks.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bench/accuracy/measured.h"
#include "palpate/instrument/tip_track.h"

namespace palpate {
namespace {

class Checks : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::path(::testing::TempDir()) / ("palpate_checks_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "truth.csv") << "frame,time_s,in_contact,force_N,tip_x_mm,tip_y_mm,tip_z_mm\n"
                                           "0,0,0,0,1,2,80\n1,0.04,1,2,1,2,81\n";
    sequence.truth = folder / "truth.csv";
    sequence.scene = YAML::Load(
        "{map: {thickness_mm: 20}, contact: {footprint_radius_mm: 3, grip: grasp},"
        " attachments: [{underside: {depth_mm: 6}}, {sphere: {center_mm: [1, 2, 90], radius_mm: 4}}]}");
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  YAML::Node told(const std::string& name) const {
    for (const Check& check : all_checks())
      if (check.name == name) return changed(sequence.scene, check.told(sequence, folder));
    ADD_FAILURE() << name;
    return {};
  }

  std::filesystem::path folder;
  Sequence sequence;
};

TEST_F(Checks, TellTheEstimatorOneThingWrongAndLeaveTheRest) {
  EXPECT_DOUBLE_EQ(value_at(told("radius_half"), "contact.footprint_radius_mm").as<double>(), 1.5);
  EXPECT_DOUBLE_EQ(value_at(told("radius_twice"), "contact.footprint_radius_mm").as<double>(), 6);
  EXPECT_EQ(value_at(told("radius_twice"), "contact.grip").as<std::string>(), "grasp");
  EXPECT_DOUBLE_EQ(value_at(told("thin"), "map.thickness_mm").as<double>(), 16);
  EXPECT_DOUBLE_EQ(value_at(sequence.scene, "map.thickness_mm").as<double>(), 20);  // the sequence's own stays
  EXPECT_EQ(scene_text(told("static")), scene_text(sequence.scene));
}

TEST_F(Checks, MoveEveryAttachmentTowardsTheCamera) {
  const YAML::Node moved = told("attachments")["attachments"];
  EXPECT_DOUBLE_EQ(moved[0]["underside"]["depth_mm"].as<double>(), 11);
  EXPECT_DOUBLE_EQ(moved[1]["sphere"]["center_mm"][2].as<double>(), 85);
  EXPECT_DOUBLE_EQ(moved[1]["sphere"]["center_mm"][0].as<double>(), 1);
}

TEST_F(Checks, GiveATipTrackThatIsOffByTheStatedBias) {
  const YAML::Node scene = told("tip_near");
  const TipTrack track = read_tip_track(value_at(scene, "instrument.track").as<std::string>());
  ASSERT_EQ(track.rows.size(), 2u);
  EXPECT_NEAR(track.rows.at(1).tip_mm.z(), 81 - 0.3, 0.15);
  EXPECT_NEAR(track.rows.at(1).tip_mm.x(), 1, 0.15);
  EXPECT_NE(track.rows.at(1).tip_mm.x(), 1);
}

TEST(SceneText, MakesKeysThatAreNotThereAndKeepsWhatStandsBesideThem) {
  const YAML::Node scene = YAML::Load("{map: {frame: 2}}");
  const YAML::Node other = changed(scene, {{"map.elements", YAML::Node(5)}, {"simulate.camera.fps", YAML::Node(10)}});
  EXPECT_EQ(value_at(other, "map.frame").as<int>(), 2);
  EXPECT_EQ(value_at(other, "map.elements").as<int>(), 5);
  EXPECT_EQ(value_at(other, "simulate.camera.fps").as<int>(), 10);
  EXPECT_FALSE(value_at(scene, "map.elements").IsDefined());
  EXPECT_FALSE(value_at(scene, "simulate.camera.fps").IsDefined());
}

TEST(Spreads, AreMiddleAndLargest) {
  EXPECT_EQ(spread({3, 1, 9}).median, 3);
  EXPECT_EQ(spread({3, 1, 9, 4}).median, 3.5);
  EXPECT_EQ(spread({3, 1, 9}).worst, 9);
}

}  // namespace
}  // namespace palpate
