#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/stereo/truth_cases.h"
#include "tests/support/reference_data.h"

// What real images contain, put into copies of a real and a rendered pair; each test states what may be lost against
// the clean pair.
namespace palpate {
namespace {

using test::MatchScore;
using test::TruthCase;
using testing::HasSubstr;
using testing::IsEmpty;

struct Loss {
  double median_px;     // may grow by
  double above_one_px;  // fraction of errors above one pixel may grow by
  double covered;       // fraction of measured pixels may fall by
};

DisparityMap match_case(const TruthCase& c, const cv::Mat& mask = {}) {
  return match(c.pair, c.rectification, mask.empty() ? cv::Mat(c.pair.left.size(), CV_8U, cv::Scalar(255)) : mask,
               c.options);
}

void expect_loss_below(const DisparityMap& degraded, const TruthCase& degraded_case, const TruthCase& clean_case,
                       const Loss& loss) {
  const MatchScore clean = score(match_case(clean_case), clean_case), got = score(degraded, degraded_case);
  EXPECT_LT(got.median_px, clean.median_px + loss.median_px) << clean_case.name;
  EXPECT_LT(got.above_one_px, clean.above_one_px + loss.above_one_px) << clean_case.name;
  EXPECT_GT(got.covered, clean.covered - loss.covered) << clean_case.name;
  EXPECT_GT(got.within_both_deviations, 0.58) << clean_case.name;
}

void put_noise(cv::Mat& image, double deviation, cv::RNG& random) {
  cv::Mat noise(image.size(), CV_16SC3);
  random.fill(noise, cv::RNG::NORMAL, 0, deviation);
  cv::add(image, noise, image, cv::noArray(), CV_8UC3);
}

// Saturated spots with a soft rim.
void put_highlights(cv::Mat& image, int count, cv::RNG& random) {
  cv::Mat light(image.size(), CV_8UC3, cv::Scalar::all(0));
  for (int i = 0; i < count; ++i) {
    const cv::Point at(random.uniform(0, image.cols), random.uniform(0, image.rows));
    cv::ellipse(light, at, {random.uniform(3, 14), random.uniform(2, 7)}, random.uniform(0, 180), 0, 360,
                cv::Scalar::all(255), -1);
  }
  cv::GaussianBlur(light, light, {5, 5}, 1);
  image += light;
}

// Smoke that lets `clear` of the light through and shines itself, thicker on one side.
void put_smoke(cv::Mat& image, double clear) {
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double thin = clear * (0.8 + 0.4 * x / image.cols);
      for (int k = 0; k < 3; ++k) {
        uchar& level = image.at<cv::Vec3b>(y, x)[k];
        level = cv::saturate_cast<uchar>(thin * level + (1 - thin) * 150);
      }
    }
}

// Every second row was taken later: the camera has moved by some pixels.
void put_comb(cv::Mat& image, double shift_px) {
  cv::Mat later;
  cv::warpAffine(image, later, cv::Matx23d(1, 0, shift_px, 0, 1, 0), image.size(), cv::INTER_CUBIC,
                 cv::BORDER_REPLICATE);
  for (int y = 1; y < image.rows; y += 2) later.row(y).copyTo(image.row(y));
}

class Degraded : public testing::TestWithParam<const char*> {
 protected:
  // Copies whose images may be written.
  static TruthCase read() {
    TruthCase c = test::read_truth_case(GetParam());
    c.pair.left = c.pair.left.clone();
    c.pair.right = c.pair.right.clone();
    return c;
  }
};

TEST_P(Degraded, HighlightsThatStandElsewhereInEachEyeCostLittle) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  TruthCase c = read();
  const TruthCase clean = read();
  cv::RNG random(5);
  const int count = static_cast<int>(c.pair.left.total() / 5000);
  put_highlights(c.pair.left, count, random);
  put_highlights(c.pair.right, count, random);
  expect_loss_below(match_case(c), c, clean, {0.01, 0.01, 0.11});
}

TEST_P(Degraded, TheBlackBorderOfTheScopeIsLeftOut) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  TruthCase c = read();
  TruthCase clean = read();
  const cv::Size size = c.pair.left.size();
  cv::Mat inside(size, CV_8U, cv::Scalar(0)), seen_by_both;
  cv::circle(inside, {size.width / 2, size.height / 2}, static_cast<int>(0.46 * size.height), cv::Scalar(255), -1);
  c.pair.left.setTo(cv::Scalar::all(3), ~inside);
  c.pair.right.setTo(cv::Scalar::all(3), ~inside);
  const DisparityMap map = match_case(c);
  EXPECT_EQ(cv::countNonZero((map.disparity_px == map.disparity_px) & ~inside), 0);
  const double max_px = 90;
  cv::warpAffine(inside, seen_by_both, cv::Matx23d(1, 0, max_px, 0, 1, 0), size, cv::INTER_NEAREST);
  c.scored &= inside & seen_by_both;
  clean.scored = c.scored;
  expect_loss_below(map, c, clean, {0.01, 0.01, 0.03});
}

TEST_P(Degraded, SmokeThatLeavesAThirdOfTheContrastKeepsMostOfTheMap) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  TruthCase c = read();
  const TruthCase clean = read();
  cv::RNG random(7);
  for (cv::Mat* image : {&c.pair.left, &c.pair.right}) {
    put_smoke(*image, 0.33);
    put_noise(*image, 1, random);
  }
  expect_loss_below(match_case(c), c, clean, {0.03, 0.01, 0.03});
}

TEST_P(Degraded, AFifthMoreOrLessLightInOneEyeCostsNextToNothing) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  const TruthCase clean = read();
  for (const double gain : {0.8, 1.2}) {
    TruthCase c = read();
    c.pair.right *= gain;
    expect_loss_below(match_case(c), c, clean, {0.005, 0.005, 0.05});
  }
}

TEST_P(Degraded, EyesThatStandOneAndAHalfRowsApartAreAlignedAndItIsSaid) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  const TruthCase clean = read();
  const DisparityMap before = match_case(clean);
  EXPECT_THAT(before.warnings, IsEmpty());
  for (const double rows : {-1.5, 0.7, 1.5}) {
    TruthCase c = read();
    cv::warpAffine(clean.pair.right, c.pair.right, cv::Matx23d(1, 0, 0, 0, 1, rows), c.pair.right.size(),
                   cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    const DisparityMap map = match_case(c);
    EXPECT_NEAR(map.row_offset_px, before.row_offset_px + rows, 0.06);
    ASSERT_EQ(map.warnings.size(), std::abs(map.row_offset_px) > 0.5 ? 1u : 0u);
    if (!map.warnings.empty()) {
      EXPECT_THAT(map.warnings[0], HasSubstr(rows > 0 ? "lower" : "higher"));
    }
    expect_loss_below(map, c, clean, {0.01, 0.01, 0.03});
  }
}

TEST_P(Degraded, ACombOfTwoPixelsKeepsTheMap) {
  PALPATE_NEEDS_REFERENCE(GetParam());
  TruthCase c = read();
  const TruthCase clean = read();
  for (cv::Mat* image : {&c.pair.left, &c.pair.right}) put_comb(*image, 2);
  expect_loss_below(match_case(c), c, clean, {0.02, 0.01, 0.03});
}

INSTANTIATE_TEST_SUITE_P(Reference, Degraded, testing::Values("scared_keyframe", "rendered_uterus"));

TEST(InstrumentInView, IsLeftOutByItsMaskAndDoesNotBendTheTissueBesideIt) {
  PALPATE_NEEDS_REFERENCE("rendered_liver");
  TruthCase c = test::read_truth_case("rendered_liver");
  cv::Mat instrument =
      cv::imread((test::reference_data() / "rendered_liver/id0_left.png").string(), cv::IMREAD_GRAYSCALE) == 2;
  const cv::Mat wide = cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9});
  cv::dilate(instrument, instrument, wide);
  const DisparityMap map = match_case(c, ~instrument);
  EXPECT_EQ(cv::countNonZero((map.disparity_px == map.disparity_px) & instrument), 0);
  cv::Mat beside;
  cv::dilate(instrument, beside, cv::getStructuringElement(cv::MORPH_ELLIPSE, {61, 61}));
  c.scored &= beside & ~instrument;
  const MatchScore got = score(map, c);
  EXPECT_LT(got.median_px, 0.05);
  EXPECT_LT(got.above_one_px, 0.02);
  EXPECT_GT(got.covered, 0.75);
}

}  // namespace
}  // namespace palpate
