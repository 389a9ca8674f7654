#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>

#include "palpate/core/errors.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/instrument/tip_track.h"
#include "tests/instrument/drawn_scene.h"

namespace palpate {
namespace {

class TipTrackFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    file_ = std::filesystem::temp_directory_path() /
            (std::string("palpate_") + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
    std::ofstream(file_) << text;
    return file_;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  std::string complaint(const std::string& text) {
    try {
      read_tip_track(write(text));
    } catch (const BadInput& error) {
      return error.what();
    }
    return "";
  }

 private:
  std::filesystem::path file_;
};

constexpr const char* kHeader = "frame,time_s,x_mm,y_mm,z_mm\n";

TEST_F(TipTrackFile, ReadsEveryRowWithAndWithoutClosed) {
  const TipTrack plain = read_tip_track(write(std::string(kHeader) + "0,0,1,2,3\r\n\n2, 0.08 ,1.5,-2,3e1\n"));
  ASSERT_EQ(plain.rows.size(), 2u);
  EXPECT_EQ(plain.rows.at(2).tip_mm, Vec3(1.5, -2, 30));
  EXPECT_DOUBLE_EQ(plain.rows.at(2).time_s, 0.08);
  EXPECT_FALSE(plain.rows.at(0).closed);
  const TipTrack closed = read_tip_track(write("frame,time_s,x_mm,y_mm,z_mm,closed\n7,0.28,1,2,3,1\n8,0.32,1,2,3,0\n"));
  EXPECT_TRUE(*closed.rows.at(7).closed);
  EXPECT_FALSE(*closed.rows.at(8).closed);
}

TEST_F(TipTrackFile, ReadsWhatASpreadsheetOrARobotMadeOfIt) {
  for (const std::string text :
       {"\xEF\xBB\xBF"
        "frame,time_s,x_mm,y_mm,z_mm\r\n0,0,1,2,80\r\n1,0.04,1.5,2,80\r\n",
        "\"frame\",\"time_s\",\"x_mm\",\"y_mm\",\"z_mm\"\n0,0,1,2,80\n1,0.04,1.5,2,80\n",
        "frame,time_s,x_mm,y_mm,z_mm,qx,qy,qz,qw\n0,0,1,2,80,0,0,0,1\n1,0.04,1.5,2,80,0,0,0,1\n",
        "Frame;Time (ms);X (m);Y (m);Z (m)\n0;0;0,001;0,002;0,08\n1;40;0,0015;0,002;0,08\n",
        "frame,timestamp,pose.position.x,pose.position.y,pose.position.z\n0,0,1,2,80\n1,40,1.5,2,80\n"}) {
    const TipTrack track = read_tip_track(write(text));
    ASSERT_EQ(track.rows.size(), 2u) << text;
    EXPECT_LT((track.rows.at(1).tip_mm - Vec3(1.5, 2, 80)).norm(), 1e-9) << text;
    EXPECT_NEAR(track.rows.at(1).time_s, 0.04, 1e-12) << text;
  }
}

TEST_F(TipTrackFile, SaysWhichLineIsWrongAndWhy) {
  EXPECT_THROW(read_tip_track("/nowhere/tip.csv"), BadInput);
  EXPECT_NE(complaint("").find("header"), std::string::npos);
  EXPECT_NE(complaint("frame,x,y,z\n").find("header"), std::string::npos);
  EXPECT_NE(complaint(kHeader).find("no rows"), std::string::npos);
  const std::string line = complaint(std::string(kHeader) + "0,0,1,2,3\n1,0.04,1,two,3\n");
  EXPECT_NE(line.find(":3:"), std::string::npos) << line;
  EXPECT_NE(line.find("y_mm is 'two'"), std::string::npos) << line;
  EXPECT_NE(complaint(std::string(kHeader) + "0,0,1,2\n").find("z_mm is ''"), std::string::npos);
  EXPECT_NE(complaint(std::string(kHeader) + "0,0,1,2,nan\n").find("finite"), std::string::npos);
  EXPECT_NE(complaint(std::string(kHeader) + "0.5,0,1,2,3\n").find("whole number"), std::string::npos);
  EXPECT_NE(complaint(std::string(kHeader) + "0,0,1,2,3\n0,0,1,2,3\n").find("twice"), std::string::npos);
  EXPECT_NE(complaint("frame,time_s,x_mm,y_mm,z_mm,closed\n0,0,1,2,3,2\n").find("closed"), std::string::npos);
}

TEST_F(TipTrackFile, WithoutFrameNumbersIsFoundByTime) {
  const std::string text = "time_s,x_mm,y_mm,z_mm\n0,1,2,80\n0.02,1.5,2,80\n0.04,2,2,80\n0.06,2.5,2,80\n0.08,3,2,80\n";
  const TipTrack track = read_tip_track(write(text));
  EXPECT_FALSE(track.has_frames);
  EXPECT_EQ(row_of_frame(track, 1, 0.04, 0)->tip_mm, Vec3(2, 2, 80));
  EXPECT_EQ(row_of_frame(track, 2, 0.0800000001, 0)->tip_mm, Vec3(3, 2, 80));
  EXPECT_NEAR(row_of_frame(track, 1, 0.04, 0.01)->tip_mm.x(), 2.25, 1e-9);
  EXPECT_FALSE(row_of_frame(track, 3, 0.12, 0));
  EXPECT_NE(complaint(text + "0.05,1,2,80\n").find(":7: time 0.05 s after 0.08 s"), std::string::npos);
  EXPECT_NE(complaint("x_mm,y_mm,z_mm\n1,2,80\n").find("no column frame and none time_s"), std::string::npos);
  const TipTrack numbered = read_tip_track(write(std::string(kHeader) + "4,0.5,1,2,80\n5,0.54,2,2,80\n"));
  EXPECT_EQ(row_of_frame(numbered, 5, 0.2, 0)->tip_mm, Vec3(2, 2, 80));
}

TEST_F(TipTrackFile, OfARobotsOwnClockNeedsItsOffset) {
  InstrumentOptions options;
  options.track = write(
      "%time,field.header.stamp,field.transform.rotation.x,field.transform.translation.x,"
      "field.transform.translation.y,field.transform.translation.z\n"
      "0,1700000000000000000,0.7,0.001,0.0025,0.06\n0,1700000000040000000,0.7,0.002,0.0025,0.061\n"
      "0,1700000000080000000,0.7,0.003,0.0025,0.062\n");
  const auto scene = test::draw_pair({.instrument = false}, {}, 0);
  try {
    InstrumentTracker(options, test::drawn_rectification(), scene, {});
    ADD_FAILURE() << "a clock since 1970 was taken for the video's";
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("instrument.time_offset_s"), std::string::npos) << error.what();
  }
  options.time_offset_s = 1700000000;
  InstrumentTracker tracker(options, test::drawn_rectification(), scene, {});
  RectifiedPair pair = scene;
  pair.index = 1;
  pair.time_s = 0.04;
  EXPECT_LT((tracker.update(pair).tips[0].tip_mm - Vec3(2, 2.5, 61)).norm(), 1e-4);
}

TEST_F(TipTrackFile, InMetresThatNoUnitStatesIsRefused) {
  const std::string rows = "0,0,0.001,0.0025,0.06\n1,0.04,0.002,0.0025,0.061\n";
  const std::string sentence = complaint("frame,time,x,y,z\n" + rows);
  EXPECT_NE(sentence.find("x, y, z are 0.061 at most"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("x_m, y_m, z_m"), std::string::npos) << sentence;
  for (const char* header : {"frame,time,x_m,y_m,z_m\n", "frame,time,x,y,z\n[-],[s],[m],[m],[m]\n",
                             "frame,time,pose.position.x,pose.position.y,pose.position.z\n"})
    EXPECT_LT((read_tip_track(write(header + rows)).rows.at(1).tip_mm - Vec3(2, 2.5, 61)).norm(), 1e-9) << header;
  EXPECT_EQ(read_tip_track(write("frame,time,x_mm,y_mm,z_mm\n0,0,0.1,0.2,0.3\n")).rows.at(0).tip_mm.x(), 0.1);
}

TEST_F(TipTrackFile, ThatCountsFramesFromOneAtTimeZeroIsRefused) {
  const std::string sentence = complaint(std::string(kHeader) + "1,0.00,1,2,60\n2,0.04,2,2,61\n");
  EXPECT_NE(sentence.find(":2: frame 1 is at 0 s"), std::string::npos) << sentence;
  EXPECT_EQ(complaint(std::string(kHeader) + "1,0.04,1,2,60\n2,0.08,2,2,61\n"), "");
  EXPECT_NE(complaint(std::string(kHeader) + "0,0,1,2,60\n1,0.04,1,234.5,2,60\n").find("line 3 has 6 values"),
            std::string::npos);
}

TEST_F(TipTrackFile, ReplacesTheImages) {
  InstrumentOptions options;
  options.track = write("frame,time_s,x_mm,y_mm,z_mm,closed\n1,0.04,1,2,80,0\n2,0.08,1.2,2,80,1\n4,0.16,2,2,81,1\n");
  const auto scene = test::draw_pair({.instrument = false}, {}, 0);
  InstrumentTracker tracker(options, test::drawn_rectification(), scene, {});
  RectifiedPair pair = scene;
  std::vector<TipObservation> seen;
  for (int frame = 0; frame < 5; ++frame) {
    pair.index = frame;
    seen.push_back(tracker.update(pair).tips[0]);
    if (frame == 2) tracker.mark(0);
  }
  EXPECT_FALSE(seen[0].visible);
  EXPECT_FALSE(seen[3].visible);
  EXPECT_EQ(seen[2].tip_mm, Vec3(1.2, 2, 80));
  EXPECT_TRUE(*seen[2].closed);
  EXPECT_NEAR(seen[2].velocity_mm_per_s.x(), 5, 1e-9);
  EXPECT_FALSE(seen[2].since_mark_mm);
  ASSERT_TRUE(seen[4].since_mark_mm);
  EXPECT_NEAR((*seen[4].since_mark_mm - Vec3(0.8, 0, 1)).norm(), 0, 1e-12);
}

TEST(InstrumentOptions, RefuseAnUnknownSegmentation) {
  for (const char* word : {"tool.pt", "colours"}) {
    InstrumentOptions options;
    options.segmentation = "colour";
    Settings settings;
    describe(settings, options);
    try {
      read_settings(YAML::Load(std::string("segmentation: ") + word), {}, settings, "instrument.");
      ADD_FAILURE() << word << " was taken";
    } catch (const BadInput& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace palpate
