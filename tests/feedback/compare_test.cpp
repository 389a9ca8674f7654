#include "palpate/feedback/compare.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <limits>
#include <map>

#include "palpate/core/errors.h"
#include "tests/feedback/temporary_folder.h"

namespace palpate {
namespace {

constexpr const char* kTruth = R"csv(frame,time_s,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm
0,0.00,0,0,0,0,0,10,-7,70
1,0.04,0,0,0,0,0,8,-8,75
2,0.08,0,0,0,0,0,6,-9,80
3,0.12,1,0.02,-0.03,-0.06,0.07,5,-10,84
4,0.16,1,0.4,-0.4,-1.4,1.509967,5,-10,83
5,0.20,1,1.2,-1.3,-4.5,4.835287,5.1,-10.2,82
6,0.24,1,2.6,-2.9,-9.6,10.359058,5.2,-10.4,81
7,0.28,1,3.1,-3.5,-11.8,12.694487,5.3,-10.5,80.5
8,0.32,1,1.5,-1.7,-5.6,6.041523,5.1,-10.2,82
9,0.36,1,0.1,-0.1,-0.3,0.331662,5,-10,84
10,0.40,0,0,0,0,0,6,-9,80
11,0.44,0,0,0,0,0,8,-8,75
)csv";

/// A frame lost, a frame missing, one false onset, one frame without a solution, one stale map, one early release.
constexpr const char* kEstimate =
    R"csv(frame,time_s,status,in_contact,fx_N,fy_N,fz_N,force_N,mean_nodal_force_N,tip_x_mm,tip_y_mm,tip_z_mm,max_von_mises_kPa,residual,frame_ms,misfit_mm,warnings
0,0.00,no_contact,0,0,0,0,0,0,10.2,-7.1,70.9,0,0,20,0,
1,0.04,tool_lost,0,0,0,0,0,0,0,0,0,0,0,20,0,
2,0.08,ok,1,0.1,-0.1,-0.2,0.244949,0.02,6.1,-9,81,2,1e-7,20,0,
3,0.12,ok,1,0.1,-0.1,-0.3,0.331662,0.02,5,-10.1,84.5,3,1e-7,20,0,
4,0.16,ok,1,0.5,-0.2,-1.2,1.315295,0.1,5.2,-10,83.8,10,1e-7,20,0,
5,0.20,ok,1,1.4,-1.1,-4.0,4.378356,0.3,5.1,-10.4,82.7,40,1e-7,20,0,law_out_of_range
6,0.24,not_converged,1,0,0,0,0,0,5.2,-10.4,81.5,0,0.3,20,0,law_out_of_range;near_attachment
7,0.28,ok,1,2.9,-3.9,-10.9,11.935660,0.9,5.4,-10.5,81.0,99,1e-7,20,0,
8,0.32,ok,1,1.6,-1.4,-5.9,6.271363,0.4,5.1,-10.3,82.6,50,1e-7,20,0,
10,0.40,map_stale,0,0.1,0,-0.1,0.141421,0.01,6.1,-9.1,80.4,1,1e-7,20,0,
)csv";

class Compare : public test::TemporaryFolder {
 protected:
  Comparison compared(const std::string& estimate, const std::string& truth) const {
    write("forces.csv", estimate);
    write("truth.csv", truth);
    return compare(read_forces(file("forces.csv")), read_forces(file("truth.csv")));
  }
};

/// Rows of so many frames from `first`, with a time of their own.
std::string counted_rows(int first, double begin_s, int frames) {
  std::string text = "frame,time_s,force_N\n";
  for (int i = 0; i < frames; ++i) text += fmt::format("{},{:.4f},{}\n", first + i, begin_s + 0.04 * i, i);
  return text;
}

TEST_F(Compare, RefusesFramesThatTheTruthCountsFromOneByTheirTimes) {
  const std::string estimate = counted_rows(0, 0, 9);
  EXPECT_THAT(
      [&] { compared(estimate, counted_rows(1, 0, 9)); },
      testing::ThrowsMessage<BadInput>(testing::AllOf(testing::HasSubstr("line 2 of the truth has frame 1 at 0 s"),
                                                      testing::HasSubstr("the estimate has at 0.04 s"))));
  // A part of the frames, another clock, and no times at all contradict nothing.
  EXPECT_NEAR(compared(estimate, counted_rows(3, 0.12, 4)).force_rmse_N, 3, 1e-9);
  EXPECT_NEAR(compared(estimate, counted_rows(0, 1.4, 9)).force_rmse_N, 0, 1e-9);
  EXPECT_NEAR(compared(estimate, "frame,force_N\n1,1\n2,2\n").force_rmse_N, 0, 1e-9);
}

TEST_F(Compare, GivesTheFiguresOfTheReferenceScorer) {
  // Printed by the reference scorer for the same two files.
  const std::map<std::string, double> expected = {{"frames", 12},
                                                  {"missing_frames", 2},
                                                  {"true_peak_N", 12.694487},
                                                  {"est_peak_N", 11.93566},
                                                  {"force_rmse_N", 3.0061586397977513},
                                                  {"force_nrmse_pct", 23.680820184366265},
                                                  {"force_rmse_contact_N", 3.934533504744985},
                                                  {"force_mae_N", 1.0815851666666665},
                                                  {"force_correlation", 0.7532052329372142},
                                                  {"peak_force_error_pct", -5.977610595843693},
                                                  {"gain", 0.6427670232009354},
                                                  {"vector_rmse_N", 3.0167435533479914},
                                                  {"vector_correlation", 0.8038504285678314},
                                                  {"direction_error_deg_median", 3.448014552737975},
                                                  {"true_onset_frame", 3},
                                                  {"est_onset_frame", 2},
                                                  {"onset_error_frames", -1},
                                                  {"release_error_frames", -1},
                                                  {"false_contact_frames", 2},
                                                  {"missed_contact_frames", 1},
                                                  {"missed_force_frames", 0},
                                                  {"reversed_ok_frames", 0},
                                                  {"force_onset_error_frames", 0},
                                                  {"false_force_max_N", 0.244949},
                                                  {"tip_frames", 9},
                                                  {"tip_rmse_mm", 0.6992058987801016},
                                                  {"tip_rmse_contact_mm", 0.6258327785172854}};
  size_t seen = 0;
  for (const auto& [name, value] : figures_of(compared(kEstimate, kTruth))) {
    if (name == "sign_flipped") {
      EXPECT_EQ(value, Figure(false));
      continue;
    }
    if (name.starts_with("band_")) {
      EXPECT_EQ(value, Figure()) << name;  // the file has none
      continue;
    }
    ASSERT_TRUE(expected.count(name)) << name;
    const double number = std::holds_alternative<int>(value) ? std::get<int>(value) : std::get<double>(value);
    EXPECT_NEAR(number, expected.at(name), 1e-9) << name;
    ++seen;
  }
  EXPECT_EQ(seen, expected.size());
}

TEST_F(Compare, GivesTheFiguresOfTheReferenceScorerForAFileThatIsAMess) {
  const std::string truth =
      "frame,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm\n"
      "10,0,0,0,0,0,1,2,80\n11,1,0,0,-2,2,1,2,81\n12,1,0,0,-4,4,1,2,82\n13,0,0,0,0,0,1,2,80\n14,0,0,0,0,0,,,\n";
  // Columns in another order, a quoted text, a field that is no number, a row twice, a row that ends early.
  const std::string estimate =
      "note,tip_z_mm,tip_y_mm,tip_x_mm,force_N,fz_N,fy_N,fx_N,in_contact,frame\r\n"
      "\"a, \"\"b\"\"\",80.5,2,1,0,0,0,0,0,10\r\n"
      ",81,2,1,9,-9,0,0,1,11\r\n"
      "\r\n"
      ",81,2,1.3,1.5,-1.5,oops,0,1,11.0\r\n"
      ",nan,2,1,nan,-3,0,0,1,12\r\n"
      ",80,2,1,0.03,0,0,0.03,,13\r\n"
      ",80,2,1,0,0,0,0,nan,+14\r\n";
  // Printed by the reference scorer for the same two files.
  const Comparison c = compared(estimate, truth);
  EXPECT_EQ(c.frames, 5);
  EXPECT_EQ(c.missing_frames, 0);
  EXPECT_DOUBLE_EQ(c.est_peak_N, 1.5);
  EXPECT_NEAR(c.force_rmse_N, 1.8028255600584324, 1e-12);
  EXPECT_NEAR(*c.gain, 0.15, 1e-12);
  EXPECT_NEAR(*c.vector_rmse_N, 0.5001799676116587, 1e-12);
  EXPECT_NEAR(*c.force_correlation, 0.24367244841449892, 1e-12);
  EXPECT_EQ(c.false_contact_frames, 0);
  EXPECT_EQ(c.missed_contact_frames, 0);
  EXPECT_EQ(*c.release_error_frames, 0);
  EXPECT_DOUBLE_EQ(c.false_force_max_N, 0.03);
  EXPECT_EQ(c.tip_frames, 3);
  EXPECT_NEAR(*c.tip_rmse_mm, 0.33665016461206926, 1e-12);
}

TEST_F(Compare, SaysHowOftenTheBandHoldsTheTruthAndHowWideItIs) {
  const std::string truth = "frame,in_contact,force_N\n0,0,0\n1,1,0.4\n2,1,2\n3,1,6\n4,1,10\n5,1,8\n6,0,0\n";
  // Above 0.5 N: frame 2 inside, on the edge; 3 above; 4 inside; 5 has no estimate. Frame 1 and the rest do not count.
  const std::string estimate =
      "frame,in_contact,force_N,force_low_N,force_high_N\n0,0,0,0,0.1\n1,1,9,8,9\n2,1,1.5,1,2\n3,1,5,4,5.5\n"
      "4,1,9,7,12\n6,0,0,0,0.1\n";
  const Comparison c = compared(estimate, truth);
  EXPECT_DOUBLE_EQ(c.band_coverage_pct.value(), 50);
  EXPECT_DOUBLE_EQ(c.band_half_width_pct.value(), 100 * (1 + 1.5 + 5 + 0) / 4 / 2 / 10);
  EXPECT_THAT(to_json(c), testing::HasSubstr("\"band_coverage_pct\": 50"));
  EXPECT_THAT(to_text(c), testing::ContainsRegex("band_half_width_pct +9.3750\n"));
}

TEST_F(Compare, CountsFramesThatAreOkAndPointTheOtherWay) {
  const std::string truth =
      "frame,in_contact,fx_N,fy_N,fz_N,force_N\n0,1,0,0,0.4,0.4\n1,1,0,0,2,2\n2,1,0,0,10,10\n3,1,0,0,9,9\n4,1,0,0,9,"
      "9\n";
  // Frame 0 is too small to judge, 2 is not ok, 3 is off by less, 4 is off by just more than a right angle.
  const std::string estimate =
      "frame,status,in_contact,fx_N,fy_N,fz_N,force_N\n0,ok,1,0,0,-1,1\n1,ok,1,0,0,-1,1\n2,map_stale,1,0,0,-9,9\n"
      "3,ok,1,9,0,0.1,9\n4,ok,1,9,0,-0.1,9\n";
  EXPECT_EQ(compared(estimate, truth).reversed_ok_frames, 2);
}

TEST_F(Compare, CountsMissedFramesThatMatterFromTheThirdOfAContactOn) {
  const std::string truth =
      "frame,in_contact,force_N\n0,1,5\n1,1,9\n2,1,10\n3,1,0.4\n4,0,0\n5,1,5\n6,1,5\n7,1,5\n8,1,5\n";
  // Missed: 0, 1 (too early), 2, 3 (too small), 5 (early again); 7 is found; 8 is missing in the file.
  const std::string estimate = "frame,in_contact,force_N\n0,0,0\n1,0,0\n2,0,0\n3,0,0\n4,0,0\n5,0,0\n6,1,5\n7,1,5\n";
  const Comparison c = compared(estimate, truth);
  EXPECT_EQ(c.missed_force_frames, 2);
  EXPECT_EQ(c.missed_contact_frames, 6);
}

TEST_F(Compare, LeavesVectorsOpenForATruthThatKnowsTheMagnitudeOnly) {
  const Comparison c = compared("frame,force_N\n0,1\n1,2\n", "frame,force_N\n0,0\n1,2\n");
  EXPECT_DOUBLE_EQ(c.force_rmse_N, std::sqrt(0.5));
  EXPECT_FALSE(c.vector_rmse_N.has_value());
  EXPECT_FALSE(c.direction_error_deg_median.has_value());
  EXPECT_FALSE(c.true_onset_frame.has_value());
}

TEST_F(Compare, OfTheTruthWithItselfIsPerfect) {
  const Comparison c = compared(kTruth, kTruth);
  EXPECT_EQ(c.force_rmse_N, 0);
  EXPECT_NEAR(*c.force_correlation, 1, 1e-12);
  EXPECT_EQ(c.false_contact_frames, 0);
  EXPECT_EQ(c.missed_contact_frames, 0);
  EXPECT_EQ(*c.tip_rmse_mm, 0);
}

TEST_F(Compare, NoticesAForceOfTheWrongSign) {
  std::vector<ForceRow> truth;
  write("truth.csv", kTruth);
  truth = read_forces(file("truth.csv"));
  std::vector<ForceRow> estimate = truth;
  for (ForceRow& row : estimate) row.force_N *= -1;
  const Comparison c = compare(estimate, truth);
  EXPECT_TRUE(*c.sign_flipped);
  EXPECT_NEAR(*c.direction_error_deg_median, 180, 0.1);
  EXPECT_EQ(c.force_rmse_N, 0);
}

TEST_F(Compare, CountsAnEstimateThatIsNotFiniteAsNoForceAndNoTip) {
  const std::string header = "frame,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm\n";
  const Comparison c = compared(header + "0,1,nan,nan,nan,nan,nan,0,80\n", header + "0,1,0,0,2,2,0,0,80\n");
  EXPECT_EQ(c.est_peak_N, 0);
  EXPECT_EQ(c.force_rmse_N, 2);
  EXPECT_EQ(c.tip_frames, 0);
  EXPECT_FALSE(c.tip_rmse_mm.has_value());
}

TEST_F(Compare, LeavesOpenWhatATruthWithoutContactCannotSay) {
  const std::string rest = "frame,in_contact,fx_N,fy_N,fz_N,force_N\n0,0,0,0,0,0\n1,0,0,0,0,0\n";
  const Comparison c = compared(rest, rest);
  EXPECT_FALSE(c.force_nrmse_pct.has_value());
  EXPECT_FALSE(c.onset_error_frames.has_value());
  EXPECT_THAT(to_json(c), testing::HasSubstr("\"force_nrmse_pct\": null"));
  EXPECT_THAT(to_text(c), testing::ContainsRegex("force_nrmse_pct +-\n"));
}

TEST(CompareRows, RefuseATruthThatIsEmptyOrNotFinite) {
  EXPECT_THROW(compare({}, {}), BadInput);
  ForceRow row;
  row.force_magnitude_N = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(compare({}, {row}), BadInput);
}

}  // namespace
}  // namespace palpate
