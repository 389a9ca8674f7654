
#include "palpate/stereo/match.h"
#include "palpate/stereo/recording.h"
#include "tests/stereo/truth_cases.h"
#include "tests/support/reference_data.h"

// Measured on the reference data; limits stand a little above what was measured, and below what OpenCV's semi-global
// matcher reaches on the same pixels.
namespace palpate {
namespace {

struct Limits {
  const char* name;
  double mean_px, median_px, above_one_px, covered;
};

class KnownDisparity : public testing::TestWithParam<Limits> {};

TEST_P(KnownDisparity, IsFoundAndTheDeviationHolds) {
  const Limits limits = GetParam();
  PALPATE_NEEDS_REFERENCE(limits.name);
  const test::TruthCase c = test::read_truth_case(limits.name);
  const test::MatchScore got =
      score(match(c.pair, c.rectification, cv::Mat(c.pair.left.size(), CV_8U, cv::Scalar(255)), c.options), c);
  EXPECT_LT(got.mean_px, limits.mean_px);
  EXPECT_LT(got.median_px, limits.median_px);
  EXPECT_LT(got.above_one_px, limits.above_one_px);
  EXPECT_GT(got.covered, limits.covered);
  EXPECT_GT(got.within_both_deviations, 0.58);
  EXPECT_LT(got.within_both_deviations, 0.78);
}

INSTANTIATE_TEST_SUITE_P(Reference, KnownDisparity,
                         testing::Values(Limits{"scared_keyframe", 0.31, 0.225, 0.025, 0.93},
                                         Limits{"rendered_liver", 0.08, 0.03, 0.004, 0.98},
                                         Limits{"rendered_uterus", 0.06, 0.035, 0.002, 0.98},
                                         Limits{"motorcycle", 0.55, 0.13, 0.063, 0.83}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(LivingTissue, IsCoveredAndItsRowOffsetFound) {
  PALPATE_NEEDS_REFERENCE("surgt_tissue");
  RecordingOptions options;
  options.stereo = test::reference_data() / "surgt_tissue/video.mp4";
  options.calibration = test::reference_data() / "surgt_tissue/calibration.yaml";
  Recording recording(options);
  EXPECT_EQ(recording.size(), cv::Size(1280, 1024));
  EXPECT_EQ(recording.frame_count(), 10);
  const Rectification rectification = make_rectification(read_rig(options.calibration), recording.size());
  const DisparityMap map =
      match(rectify(rectification, *recording.next()), rectification, rectification.valid_left, {});
  EXPECT_NEAR(map.row_offset_px, -0.4, 0.1);
  const cv::Mat found = map.disparity_px == map.disparity_px;
  EXPECT_GT(cv::countNonZero(found), 1280 * 1024 * 8 / 10);
  std::vector<float> depths;
  for (int y = 0; y < found.rows; ++y)
    for (int x = 0; x < found.cols; ++x)
      if (found.at<uchar>(y, x))
        depths.push_back(static_cast<float>(rectification.depth_mm(map.disparity_px.at<float>(y, x))));
  std::sort(depths.begin(), depths.end());
  EXPECT_NEAR(depths[depths.size() / 200], 29, 4);
  EXPECT_NEAR(depths[depths.size() * 199 / 200], 150, 35);
}

}  // namespace
}  // namespace palpate
