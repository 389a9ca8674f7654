#include "palpate/feedback/forces_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "palpate/core/errors.h"
#include "tests/feedback/temporary_folder.h"

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ForceEstimate pull(FrameStatus status) {
  ForceEstimate estimate;
  estimate.frame = 7;
  estimate.time_s = 0.28;
  estimate.status = status;
  estimate.in_contact = true;
  estimate.force_N = {3, -4, -12};
  estimate.mean_nodal_force_N = 0.75;
  estimate.tip_mm = {1.5, -2.5, 88};
  estimate.max_von_mises_kPa = 54.5;
  estimate.residual = 2e-7;
  estimate.misfit_mm = 0.125;
  estimate.warnings = {"law_out_of_range", "near_attachment"};
  estimate.times.solve_ms = 6;
  estimate.times.draw_ms = 2.5;
  return estimate;
}

class ForcesFile : public test::TemporaryFolder {};

TEST_F(ForcesFile, GivesBackWhatWasWritten) {
  ForcesWriter(file("forces.csv")).write(pull(FrameStatus::ok));
  const std::vector<ForceRow> rows = read_forces(file("forces.csv"));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].frame, 7);
  EXPECT_DOUBLE_EQ(rows[0].time_s, 0.28);
  EXPECT_EQ(rows[0].status, "ok");
  EXPECT_TRUE(rows[0].in_contact);
  EXPECT_EQ(rows[0].force_N, Vec3(3, -4, -12));
  EXPECT_DOUBLE_EQ(rows[0].force_magnitude_N, 13);
  EXPECT_DOUBLE_EQ(rows[0].mean_nodal_force_N, 0.75);
  EXPECT_EQ(rows[0].tip_mm, Vec3(1.5, -2.5, 88));
  EXPECT_DOUBLE_EQ(rows[0].max_von_mises_kPa, 54.5);
  EXPECT_DOUBLE_EQ(rows[0].residual, 2e-7);
  EXPECT_DOUBLE_EQ(rows[0].frame_ms, 8.5);
  EXPECT_DOUBLE_EQ(rows[0].misfit_mm, 0.125);
  EXPECT_EQ(rows[0].warnings, "law_out_of_range;near_attachment");
}

TEST_F(ForcesFile, HasTheColumnsOfTheContract) {
  ForcesWriter(file("forces.csv")).write(pull(FrameStatus::ok));
  EXPECT_THAT(
      text_of("forces.csv"),
      testing::StartsWith("frame,time_s,status,in_contact,fx_N,fy_N,fz_N,force_N,mean_nodal_force_N,tip_x_mm,tip_y_mm,"
                          "tip_z_mm,max_von_mises_kPa,residual,frame_ms,misfit_mm,warnings,force_low_N,force_high_N,"
                          "force_low_total_N,force_high_total_N,grip,p_contact,footprint_mm,scene_x_mm,scene_y_mm,"
                          "scene_z_mm\n7,"));
}

TEST_F(ForcesFile, KeepsEveryRowWhileTheWriterIsStillOpen) {
  ForcesWriter writer(file("forces.csv"));
  writer.write(pull(FrameStatus::ok));
  EXPECT_EQ(read_forces(file("forces.csv")).size(), 1u);
  writer.write(pull(FrameStatus::tool_lost));
  EXPECT_EQ(read_forces(file("forces.csv")).size(), 2u);
}

TEST_F(ForcesFile, OfASecondInstrumentBeginsWhenOneIsSeenWithARowForEveryFrame) {
  write("forces_2.csv", "of an earlier run");
  SecondForcesWriter writer(file("forces_2.csv"));
  EXPECT_FALSE(std::filesystem::exists(file("forces_2.csv")));
  ForceEstimate estimate;
  estimate.further.resize(1);
  const auto answer = [&](int frame, FrameStatus status) {
    estimate.frame = estimate.further[0].frame = frame;
    estimate.further[0].status = status;
    writer.write(estimate);
  };
  answer(0, FrameStatus::tool_lost);
  answer(1, FrameStatus::tool_lost);
  EXPECT_FALSE(std::filesystem::exists(file("forces_2.csv")));
  EXPECT_TRUE(writer.rows().empty());
  answer(2, FrameStatus::no_contact);
  answer(3, FrameStatus::tool_lost);
  const std::vector<ForceRow> rows = read_forces(file("forces_2.csv"));
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(writer.rows().size(), 4u);
  for (int frame = 0; frame < 4; ++frame) {
    EXPECT_EQ(rows[static_cast<size_t>(frame)].frame, frame);
    EXPECT_EQ(rows[static_cast<size_t>(frame)].status, frame == 2 ? "no_contact" : "tool_lost");
  }
}

TEST(ForceRow, OfALostToolIsAllZeros) {
  const ForceRow row = to_row(pull(FrameStatus::tool_lost));
  EXPECT_EQ(row.status, "tool_lost");
  EXPECT_FALSE(row.in_contact);
  EXPECT_EQ(row.force_N, Vec3::Zero().eval());
  EXPECT_EQ(row.force_magnitude_N, 0);
  EXPECT_EQ(row.tip_mm, Vec3::Zero().eval());
  EXPECT_FALSE(row.has_tip());
}

TEST(ForceRow, WithoutASolutionHasAContactAndATipButNoForce) {
  const ForceRow row = to_row(pull(FrameStatus::not_converged));
  EXPECT_EQ(row.status, "not_converged");
  EXPECT_TRUE(row.in_contact);
  EXPECT_EQ(row.force_magnitude_N, 0);
  EXPECT_EQ(row.mean_nodal_force_N, 0);
  EXPECT_EQ(row.tip_mm, Vec3(1.5, -2.5, 88));
}

TEST(ForceRow, WithoutContactHasATipAndNoForce) {
  const ForceRow row = to_row(pull(FrameStatus::no_contact));
  EXPECT_FALSE(row.in_contact);
  EXPECT_EQ(row.force_magnitude_N, 0);
  EXPECT_TRUE(row.has_tip());
}

TEST(ForceRow, OfAStaleMapKeepsForceAndContactAsFound) {
  ForceEstimate estimate = pull(FrameStatus::map_stale);
  EXPECT_DOUBLE_EQ(to_row(estimate).force_magnitude_N, 13);
  EXPECT_TRUE(to_row(estimate).in_contact);
  estimate.in_contact = false;
  EXPECT_FALSE(to_row(estimate).in_contact);
}

TEST_F(ForcesFile, NeverHoldsANumberThatIsNotFinite) {
  ForcesWriter writer(file("forces.csv"));
  for (const FrameStatus status : {FrameStatus::ok, FrameStatus::no_contact, FrameStatus::tool_lost,
                                   FrameStatus::not_converged, FrameStatus::map_stale}) {
    ForceEstimate estimate = pull(status);
    estimate.force_N.y() = kNan;
    estimate.mean_nodal_force_N = kNan;
    estimate.residual = std::numeric_limits<double>::infinity();
    estimate.max_von_mises_kPa = kNan;
    estimate.misfit_mm = kNan;
    estimate.times.solve_ms = kNan;
    writer.write(estimate);
    estimate.tip_mm.x() = kNan;
    writer.write(estimate);
  }
  EXPECT_THAT(text_of("forces.csv"), testing::Not(testing::HasSubstr("nan")));
  EXPECT_THAT(text_of("forces.csv"), testing::Not(testing::HasSubstr("inf")));
}

TEST(ForceRow, WithAForceThatIsNotFiniteDidNotConverge) {
  ForceEstimate estimate = pull(FrameStatus::ok);
  estimate.force_N.y() = kNan;
  EXPECT_EQ(to_row(estimate).status, "not_converged");
}

TEST(ForceRow, WithATipThatIsNotFiniteLostTheTool) {
  ForceEstimate estimate = pull(FrameStatus::ok);
  estimate.tip_mm.z() = kNan;
  EXPECT_EQ(to_row(estimate).status, "tool_lost");
}

TEST_F(ForcesFile, IsReadByColumnNames) {
  write("truth.csv",
        "force_N,fz_N,fy_N,fx_N,in_contact,frame,tip_z_mm,tip_y_mm,tip_x_mm\r\n13,-12,-4,3,1,5,88,-2,1\r\n\r\n");
  const std::vector<ForceRow> rows = read_forces(file("truth.csv"));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].frame, 5);
  EXPECT_EQ(rows[0].force_N, Vec3(3, -4, -12));
  EXPECT_EQ(rows[0].tip_mm, Vec3(1, -2, 88));
  EXPECT_EQ(rows[0].status, "");
}

TEST_F(ForcesFile, WithoutTipColumnsHasNoTip) {
  write("plate.csv", "frame,in_contact,fx_N,fy_N,fz_N,force_N\n0,1,0,0,2,2\n");
  EXPECT_FALSE(read_forces(file("plate.csv")).at(0).has_tip());
}

TEST_F(ForcesFile, TakesQuotesByteOrderMarkCrlfAndFurtherColumns) {
  write("truth.csv",
        "\xEF\xBB\xBF\"frame\",note,\"in_contact\",fx_N, fy_N ,fz_N,force_N,time_s\r\n"
        "\"4\",\"a \"\"b\"\", c\nd\",\"1\",+3,-4,\" -12 \",1.3e1,0.16\r\n5,,0,0,0,0,0,0.2");
  const std::vector<ForceRow> rows = read_forces(file("truth.csv"));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].frame, 4);
  EXPECT_TRUE(rows[0].in_contact);
  EXPECT_EQ(rows[0].force_N, Vec3(3, -4, -12));
  EXPECT_EQ(rows[0].force_magnitude_N, 13);
  EXPECT_DOUBLE_EQ(rows[0].time_s, 0.16);
  EXPECT_EQ(rows[1].frame, 5);
}

TEST_F(ForcesFile, ClaimsNothingWhereAFieldIsMissingOrNoNumber) {
  write("short.csv",
        "frame,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm\n"
        "0,1,0,0,oops,,1,2,nan\n1,1,0,0,2,2,1,2,80\n2,,1\n");
  const std::vector<ForceRow> rows = read_forces(file("short.csv"));
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_TRUE(std::isnan(rows[0].force_N.z()));
  EXPECT_TRUE(std::isnan(rows[0].force_magnitude_N));
  EXPECT_FALSE(rows[0].has_tip());
  EXPECT_EQ(rows[1].force_magnitude_N, 2);
  EXPECT_TRUE(rows[1].has_tip());
  EXPECT_FALSE(rows[2].in_contact);
  EXPECT_TRUE(std::isnan(rows[2].force_magnitude_N));
}

TEST_F(ForcesFile, NamesFileAndLineOfARowWithoutFrame) {
  write("bad.csv", "frame,force_N\n0,0\n,0\n");
  try {
    read_forces(file("bad.csv"));
    FAIL() << "expected BadInput";
  } catch (const BadInput& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("bad.csv, line 3: column frame is \"\""));
  }
}

TEST_F(ForcesFile, RefusesAFileWithoutForces) {
  write("bad.csv", "frame,in_contact,fx_N,fy_N,fz_N\n");
  write("empty.csv", "");
  for (const char* name : {"bad.csv", "empty.csv", "missing.csv", "."})
    EXPECT_THROW(read_forces(file(name)), BadInput) << name;
}

TEST_F(ForcesFile, OfATruthHasRowsAndFiniteForces) {
  write("none.csv", "frame,force_N\n");
  write("nan.csv", "frame,force_N\n0,0\n1,nan\n");
  write("good.csv", "frame,force_N\n0,0\n1,2\n");
  EXPECT_THROW(read_truth(file("none.csv")), BadInput);
  EXPECT_THROW(read_truth(file("nan.csv")), BadInput);
  EXPECT_EQ(read_truth(file("good.csv")).size(), 2u);
}

TEST_F(ForcesFile, CannotBeginInAFolderThatDoesNotExist) {
  EXPECT_THROW(ForcesWriter(file("nowhere") / "forces.csv"), Unfinished);
}

}  // namespace
}  // namespace palpate
