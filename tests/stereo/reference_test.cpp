#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/match.h"
#include "palpate/stereo/recording.h"
#include "tests/support/reference_data.h"

// Measured on the reference data; limits stand a little above what was measured, and below what OpenCV's semi-global
// matcher reaches on the same pixels.
namespace palpate {
namespace {

struct Score {
  double mean_px = 0, median_px = 0, above_one_px = 0, coverage = 0, within_one_deviation = 0;
};

Score score(const DisparityMap& map, const cv::Mat& truth_px, const cv::Mat& region) {
  std::vector<double> errors;
  Score result;
  int pixels = 0;
  for (int y = 0; y < truth_px.rows; ++y)
    for (int x = 0; x < truth_px.cols; ++x) {
      if (!region.at<uchar>(y, x)) continue;
      ++pixels;
      const double d = map.disparity_px.at<float>(y, x);
      if (std::isnan(d)) continue;
      const double error = std::abs(d - truth_px.at<float>(y, x));
      errors.push_back(error);
      result.mean_px += error;
      result.above_one_px += error > 1;
      result.within_one_deviation += error < map.deviation_px.at<float>(y, x);
    }
  const double count = static_cast<double>(errors.size());
  result.mean_px /= count;
  result.above_one_px /= count;
  result.within_one_deviation /= count;
  result.coverage = count / pixels;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  result.median_px = *middle;
  return result;
}

class RenderedOrgan : public testing::TestWithParam<const char*> {};

TEST_P(RenderedOrgan, IsMatchedFarBelowAPixel) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  const std::filesystem::path folder = test::reference_data() / GetParam();
  RecordingOptions options;
  options.left = folder / "left.mp4";
  options.right = folder / "right.mp4";
  options.calibration = folder / "calibration.yaml";
  Recording recording(options);
  const Rectification rectification = make_rectification(read_rig(options.calibration), recording.size());
  EXPECT_TRUE(rectification.identity);
  const RectifiedPair pair = rectify(rectification, *recording.next());
  const cv::Mat depth = cv::imread((folder / "depth0_left.tiff").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat truth = rectification.focal_px * rectification.baseline_mm / depth;
  const cv::Mat organ = cv::imread((folder / "id0_left.png").string(), cv::IMREAD_GRAYSCALE) == 1;

  const Score got =
      score(match(pair, rectification, cv::Mat(recording.size(), CV_8U, cv::Scalar(255)), {}), truth, organ);
  EXPECT_LT(got.mean_px, 0.10);
  EXPECT_LT(got.median_px, 0.045);
  EXPECT_LT(got.above_one_px, 0.008);
  EXPECT_GT(got.coverage, 0.97);
  EXPECT_GT(got.within_one_deviation, 0.5);
  EXPECT_LT(got.within_one_deviation, 0.86);
}

INSTANTIATE_TEST_SUITE_P(Reference, RenderedOrgan, testing::Values("rendered_liver", "rendered_uterus"));

TEST(PorcineAbdomen, AgreesWithStructuredLight) {
  PALPATE_NEEDS_REFERENCE("scared_keyframe");
  const std::filesystem::path folder = test::reference_data() / "scared_keyframe";
  RectifiedPair pair;
  pair.left = cv::imread((folder / "left.png").string());
  pair.right = cv::imread((folder / "right.png").string());
  cv::Mat truth;
  cv::imread((folder / "disparity_px.tiff").string(), cv::IMREAD_UNCHANGED).convertTo(truth, CV_32F);
  const cv::Mat hidden = cv::imread((folder / "occlusion.png").string(), cv::IMREAD_GRAYSCALE) == 128;
  Rectification rectification;
  rectification.size = pair.left.size();
  rectification.focal_px = 517.5;
  rectification.baseline_mm = 4.1435;
  rectification.identity = true;
  rectification.valid_left = cv::Mat(pair.left.size(), CV_8U, cv::Scalar(255));
  rectification.valid_right = rectification.valid_left;
  const Score got = score(match(pair, rectification, rectification.valid_left, {}), truth, (truth > 0) & ~hidden);
  EXPECT_LT(got.mean_px, 0.33);
  EXPECT_LT(got.median_px, 0.24);
  EXPECT_LT(got.above_one_px, 0.032);
  EXPECT_GT(got.coverage, 0.88);
}

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
