#include "palpate/contact/map_watch.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

cv::Mat tissue(unsigned noise_seed) {
  cv::RNG pattern(5), noise(noise_seed);
  cv::Mat coarse(34, 60, CV_8UC3), image, grain(544, 960, CV_8UC3);
  pattern.fill(coarse, cv::RNG::UNIFORM, cv::Scalar(20, 30, 90), cv::Scalar(70, 90, 170));
  cv::resize(coarse, image, {960, 544}, 0, 0, cv::INTER_CUBIC);
  noise.fill(grain, cv::RNG::UNIFORM, 0, 5);
  return image + grain;
}

cv::Mat moved(const cv::Mat& image, double x, double y) {
  cv::Mat result;
  cv::warpAffine(image, result, cv::Matx23d(1, 0, x, 0, 1, y), image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return result;
}

TEST(MapWatch, TrustsAPictureOfTheSameScene) {
  const auto answer = MapWatch(tissue(1), {}).update(tissue(2), {});
  EXPECT_FALSE(answer.map_is_stale);
  EXPECT_FALSE(answer.veiled);
  EXPECT_LT(answer.median_px, 0.3);
}

TEST(MapWatch, SeesABumpedCamera) {
  const auto answer = MapWatch(tissue(1), {}).update(moved(tissue(2), 5, -4), {});
  EXPECT_TRUE(answer.map_is_stale);
  EXPECT_NEAR(answer.median_px, std::hypot(5, 4), 0.5);
}

TEST(MapWatch, SeesThatThePictureShowsAnotherPlace) {
  EXPECT_TRUE(MapWatch(tissue(1), {}).update(moved(tissue(2), 400, 200), {}).map_is_stale);
}

TEST(MapWatch, TissuePulledInOneCornerIsNoBump) {
  cv::Mat now = tissue(2);
  const cv::Rect corner(0, 0, 500, 300);
  moved(now, 8, 8)(corner).copyTo(now(corner));
  EXPECT_FALSE(MapWatch(tissue(1), {}).update(now, {}).map_is_stale);
}

TEST(MapWatch, SmokeAndDarknessVeilThePicture) {
  cv::Mat smoky;
  cv::GaussianBlur(tissue(2), smoky, {}, 4);
  smoky = 0.4 * smoky + cv::Scalar::all(110);
  const MapWatch watch(tissue(1), {});
  EXPECT_TRUE(watch.update(smoky, {}).veiled);
  EXPECT_TRUE(watch.update(cv::Mat::zeros(544, 960, CV_8UC3), {}).veiled);
}

}  // namespace
}  // namespace palpate
