#include "palpate/observe/picture_quality.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

cv::Mat noisy(int seed) {
  cv::Mat image(240, 320, CV_8UC3);
  cv::RNG random(3);
  random.fill(image, cv::RNG::NORMAL, 110, 50);
  cv::Mat noise(image.size(), CV_8UC3);
  cv::RNG sensor(seed);
  sensor.fill(noise, cv::RNG::UNIFORM, 0, 6);
  return image + noise;
}

TEST(PictureQuality, ADuplicateIsToldFromAPictureOfTheSameScene) {
  PictureWatch watch(noisy(1));
  EXPECT_FALSE(watch.update(noisy(2), noisy(3)).repeated);
  EXPECT_TRUE(watch.update(noisy(2), noisy(3)).repeated);
  EXPECT_FALSE(watch.update(noisy(4), noisy(5)).repeated);
  EXPECT_FALSE(watch.update(noisy(4), noisy(6)).repeated);
}

TEST(PictureQuality, SmokeBlurAndDarknessObscure) {
  PictureWatch watch(noisy(1));
  EXPECT_FALSE(watch.update(noisy(2), noisy(2)).obscured);
  cv::Mat blurred;
  cv::GaussianBlur(noisy(2), blurred, {}, 4);
  EXPECT_TRUE(watch.update(blurred, blurred).obscured);
  EXPECT_TRUE(watch.update(0.3 * noisy(2) + cv::Scalar::all(120), noisy(2)).obscured);
  EXPECT_TRUE(watch.update(0 * noisy(2), noisy(2)).obscured);
}

}  // namespace
}  // namespace palpate
