#include "palpate/stereo/match.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/quasi_dense.h"
#include "tests/stereo/files.h"

namespace palpate {
namespace {

using test::sentence_of;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kWidth = 480, kHeight = 320;

// A smooth random texture that is known at every real position: waves of random direction, 5 to 40 px long.
class Texture {
 public:
  explicit Texture(int seed) {
    cv::RNG random(static_cast<uint64_t>(seed));
    for (Wave& wave : waves_) {
      const double length = random.uniform(5.0, 40.0), angle = random.uniform(0.0, 2 * CV_PI);
      wave = {2 * CV_PI / length * std::cos(angle), 2 * CV_PI / length * std::sin(angle), random.uniform(0.0, 6.28),
              1.1 * std::sqrt(length)};
    }
  }
  double operator()(double x, double y) const {
    double level = 120;
    for (const Wave& wave : waves_) level += wave.height * std::sin(wave.u * x + wave.v * y + wave.phase);
    return level;
  }

 private:
  struct Wave {
    double u, v, phase, height;
  };
  std::array<Wave, 40> waves_;
};

// Disparity of the left pixel (x, y) on a slanted plane.
double slanted(double x, double y) {
  return 22.4 + 0.03 * x - 0.015 * y;
}

struct Scene {
  cv::Mat left = cv::Mat(kHeight, kWidth, CV_8UC3);
  cv::Mat right = cv::Mat(kHeight, kWidth, CV_8UC3);
};

// The right pixel (x', y) shows left x with x - d(x, y) = x'.
Scene slanted_plane(double gain = 1, double noise = 0, double row_offset = 0) {
  const Texture texture(7);
  cv::RNG random(11);
  Scene scene;
  const auto put = [&](cv::Mat& image, int x, int y, double level) {
    const double value = level + random.gaussian(1) * noise;
    image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<uchar>(value));
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      put(scene.left, x, y, texture(x, y));
      const double row = y - row_offset;
      const double left_x = (x + 22.4 - 0.015 * row) / (1 - 0.03);
      put(scene.right, x, y, gain * texture(left_x, row));
    }
  return scene;
}

Rectification plain_rectification() {
  Rectification rectification;
  rectification.size = {kWidth, kHeight};
  rectification.focal_px = 500;
  rectification.baseline_mm = 5;
  rectification.identity = true;
  rectification.valid_left = cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(255));
  rectification.valid_right = rectification.valid_left;
  return rectification;
}

cv::Mat everywhere() {
  return cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(255));
}

DisparityMap match_scene(const Scene& scene, Matcher matcher = Matcher::quasi_dense) {
  MatchOptions options;
  options.matcher = matcher;
  return match({0, 0, scene.left, scene.right}, plain_rectification(), everywhere(), options);
}

struct Errors {
  double mean = 0;
  double worst = 0;
  double coverage = 0;
  double within_one_deviation = 0;
};

// Over what both cameras see.
Errors errors_of(const DisparityMap& map) {
  Errors errors;
  int seen = 0, found = 0, within = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (x - slanted(x, y) < 0) continue;
      ++seen;
      const double d = map.disparity_px.at<float>(y, x);
      if (std::isnan(d)) continue;
      ++found;
      const double error = std::abs(d - slanted(x, y));
      errors.mean += error;
      errors.worst = std::max(errors.worst, error);
      within += error < map.deviation_px.at<float>(y, x);
    }
  errors.mean /= found;
  errors.coverage = static_cast<double>(found) / seen;
  errors.within_one_deviation = static_cast<double>(within) / found;
  return errors;
}

TEST(QuasiDense, FindsTheDisparityOfASlantedPlane) {
  const Errors errors = errors_of(match_scene(slanted_plane()));
  EXPECT_LT(errors.mean, 0.02);
  EXPECT_LT(errors.worst, 0.5);
  EXPECT_GT(errors.coverage, 0.97);
}

TEST(QuasiDense, BearsNoiseAndADifferenceInGain) {
  const Errors errors = errors_of(match_scene(slanted_plane(0.9, 2.5)));
  EXPECT_LT(errors.mean, 0.05);
  EXPECT_LT(errors.worst, 0.6);
  EXPECT_GT(errors.coverage, 0.97);
}

TEST(QuasiDense, KnowsHowFarItIsOff) {
  for (const double noise : {3.0, 6.0}) {
    const Errors errors = errors_of(match_scene(slanted_plane(1, noise)));
    EXPECT_GT(errors.within_one_deviation, 0.5) << "noise " << noise;
  }
  const DisparityMap quiet = match_scene(slanted_plane(1, 2)), loud = match_scene(slanted_plane(1, 8));
  EXPECT_GT(cv::mean(loud.deviation_px, loud.deviation_px == loud.deviation_px)[0],
            1.5 * cv::mean(quiet.deviation_px, quiet.deviation_px == quiet.deviation_px)[0]);
}

TEST(QuasiDense, MeasuresAndCorrectsTheRowOffset) {
  for (const double offset : {-1.5, -0.4, 0.8}) {
    const DisparityMap map = match_scene(slanted_plane(1, 1, offset));
    EXPECT_NEAR(map.row_offset_px, offset, 0.05);
    EXPECT_LT(errors_of(map).mean, 0.03) << "offset " << offset;
  }
}

TEST(QuasiDense, LeavesHighlightsAndTheScopeBorderOut) {
  Scene scene = slanted_plane(1, 1);
  const cv::Point left(240, 160);
  const cv::Point right(left.x - cvRound(slanted(left.x, left.y)) - 9, left.y);  // reflections stand elsewhere
  cv::circle(scene.left, left, 22, cv::Scalar::all(255), -1);
  cv::circle(scene.right, right, 22, cv::Scalar::all(255), -1);
  for (cv::Mat* image : {&scene.left, &scene.right}) (*image)(cv::Rect(0, 0, kWidth, 30)) = cv::Scalar::all(2);
  const DisparityMap map = match_scene(scene);
  EXPECT_TRUE(std::isnan(map.disparity_px.at<float>(left)));
  EXPECT_TRUE(std::isnan(map.disparity_px.at<float>(15, 200)));
  const Errors errors = errors_of(map);
  EXPECT_LT(errors.mean, 0.03);
  EXPECT_LT(errors.worst, 1.0);
}

TEST(QuasiDense, MatchesOnlyInsideTheMask) {
  const Scene scene = slanted_plane();
  cv::Mat mask(kHeight, kWidth, CV_8U, cv::Scalar(0));
  mask(cv::Rect(150, 100, 200, 120)) = 255;
  const DisparityMap map = match({0, 0, scene.left, scene.right}, plain_rectification(), mask, {});
  const cv::Mat found = map.disparity_px == map.disparity_px;
  EXPECT_EQ(cv::countNonZero(found & ~mask), 0);
  EXPECT_GT(cv::countNonZero(found & mask), 200 * 120 * 98 / 100);
}

TEST(QuasiDense, KeepsTwoSurfacesApart) {
  // A square nearer by 12 px of disparity in front of a wall.
  const Texture wall(3), square(5);
  Scene scene;
  const cv::Rect front(180, 90, 160, 130);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto level = [&](int left_x_front, int left_x_wall) {
        return cv::Vec3b::all(cv::saturate_cast<uchar>(front.contains({left_x_front, y}) ? square(left_x_front, y)
                                                                                         : wall(left_x_wall, y)));
      };
      scene.left.at<cv::Vec3b>(y, x) = level(x, x);
      scene.right.at<cv::Vec3b>(y, x) = level(x + 32, x + 20);
    }
  const DisparityMap map = match_scene(scene);
  int wrong = 0, found = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 40; x < kWidth; ++x) {
      const float d = map.disparity_px.at<float>(y, x);
      const bool hidden = !front.contains({x, y}) && front.contains({x + 12, y});
      if (std::isnan(d) || hidden) continue;
      ++found;
      wrong += std::abs(d - (front.contains({x, y}) ? 32.0f : 20.0f)) > 1;
    }
  EXPECT_GT(found, 120000);
  EXPECT_LT(wrong, found / 100);
}

TEST(QuasiDense, GivesTheSameAnswerTwice) {
  const Scene scene = slanted_plane(1, 3);
  const DisparityMap first = match_scene(scene), second = match_scene(scene);
  cv::Mat difference;
  cv::absdiff(first.disparity_px, second.disparity_px, difference);
  cv::patchNaNs(difference, 0);
  EXPECT_EQ(cv::countNonZero(difference), 0);
}

TEST(Match, OffersOpenCvsMatchersBehindTheSameResult) {
  const Scene scene = slanted_plane(1, 1);
  for (const Matcher matcher : {Matcher::sgbm, Matcher::dis}) {
    const DisparityMap map = match_scene(scene, matcher);
    EXPECT_LT(errors_of(map).mean, 0.3);
    EXPECT_GT(errors_of(map).coverage, 0.65);
    EXPECT_EQ(map.deviation_px.size(), map.disparity_px.size());
  }
}

TEST(Match, NoticesSwappedEyes) {
  Scene scene = slanted_plane(1, 1);
  std::swap(scene.left, scene.right);
  for (const Matcher matcher : {Matcher::quasi_dense, Matcher::sgbm})
    EXPECT_THAT(sentence_of([&] { match_scene(scene, matcher); }),
                AllOf(HasSubstr("swapped"), HasSubstr("swap: true")));
}

TEST(Match, SaysThatAnImageHasNoTexture) {
  Scene scene;
  for (cv::Mat* image : {&scene.left, &scene.right}) *image = cv::Scalar(90, 100, 150);
  EXPECT_THAT(sentence_of([&] { match_scene(scene); }), HasSubstr("texture"));
  cv::RNG random(3);
  for (cv::Mat* image : {&scene.left, &scene.right}) {
    cv::Mat noise(image->size(), CV_8UC3);
    random.fill(noise, cv::RNG::NORMAL, 0, 2);
    *image += noise;
  }
  EXPECT_THAT(sentence_of([&] { match_scene(scene); }), HasSubstr("texture"));
  for (cv::Mat* image : {&scene.left, &scene.right}) *image = cv::Scalar::all(0);
  EXPECT_THAT(sentence_of([&] { match_scene(scene); }), HasSubstr("texture"));
}

}  // namespace
}  // namespace palpate
