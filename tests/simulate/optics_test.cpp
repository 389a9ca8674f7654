#include "palpate/simulate/optics.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/render.h"

namespace palpate {
namespace {

SimulatedCamera small_camera() {
  SimulatedCamera camera;
  camera.width = 160;
  camera.height = 96;
  camera.focal_px = 200;
  return camera;
}

TEST(Smoke, LeavesTheShareOfLightThatItsDepthSays) {
  const SimulatedCamera camera = small_camera();
  SimulatedLook look;
  look.smoke = {0.8, 0};
  const cv::Vec3f tissue(0.05f, 0.08f, 0.4f);
  cv::Mat light(96, 160, CV_32FC3, cv::Scalar(tissue[0], tissue[1], tissue[2]));
  cv::Mat depth(96, 160, CV_32F, cv::Scalar(60));
  depth.colRange(80, 160) = 120;
  add_smoke(light, depth, camera, look, Vec3::Zero(), 0);
  const auto near = light.at<cv::Vec3f>(40, 20), far = light.at<cv::Vec3f>(40, 140);
  // Differences between colours shrink by t alone, whatever grey is added.
  EXPECT_NEAR((near[2] - near[0]) / (tissue[2] - tissue[0]), std::exp(-0.8 * 0.6), 1e-5);
  EXPECT_NEAR((far[2] - far[0]) / (tissue[2] - tissue[0]), std::exp(-0.8 * 1.2), 1e-5);
  EXPECT_GT(far[0], near[0]);
  EXPECT_GT(near[0], tissue[0]);
}

TEST(Smoke, HangsInSpaceSoThatBothEyesSeeTheSameWisps) {
  const SimulatedCamera camera = small_camera();
  SimulatedLook look;
  look.smoke = {1.0, 1.0};
  const double depth_mm = 100;
  const cv::Mat depth(96, 160, CV_32F, cv::Scalar(depth_mm));
  const auto smoke_seen = [&](double camera_x_mm, double time_s) {
    cv::Mat light(96, 160, CV_32FC3, cv::Scalar::all(0));
    add_smoke(light, depth, camera, look, {camera_x_mm, 0, 0}, time_s);
    return light;
  };
  // Wisps hang at 0.6 of the depth: 48 mm aside they are seen 48 * 200 / 60 = 160 px aside, 12 mm 40 px.
  const cv::Mat left = smoke_seen(0, 0), right = smoke_seen(12, 0);
  EXPECT_LT(cv::norm(left.colRange(60, 150), right.colRange(20, 110), cv::NORM_INF), 2e-3);
  EXPECT_GT(cv::norm(left.colRange(20, 110), right.colRange(20, 110), cv::NORM_INF), 1e-2);
  EXPECT_GT(cv::norm(left, smoke_seen(0, 1), cv::NORM_INF), 1e-2);  // and drift
}

TEST(Border, IsDarkOutsideAndLeavesTheMiddleAlone) {
  const cv::Mat before(101, 141, CV_32FC3, cv::Scalar::all(0.5));
  cv::Mat after = before.clone();
  add_border(after, {40, 10});
  EXPECT_EQ(after.at<cv::Vec3f>(50, 70 + 34)[0], 0.5f);
  EXPECT_NEAR(after.at<cv::Vec3f>(50, 70 + 40)[0], 0.25f, 1e-6f);
  EXPECT_EQ(after.at<cv::Vec3f>(50, 70 + 46)[0], 0);
  EXPECT_EQ(after.at<cv::Vec3f>(0, 0)[1], 0);
  cv::Mat untouched = before.clone();
  add_border(untouched, {0, 10});
  EXPECT_EQ(cv::norm(before, untouched, cv::NORM_INF), 0);
}

TEST(Interlace, TakesEvenRowsFromTheFirstAndOddOnesFromTheSecondField) {
  const cv::Mat first(6, 4, CV_32FC3, cv::Scalar::all(1)), second(6, 4, CV_32FC3, cv::Scalar::all(2));
  const cv::Mat frame = woven(first, second);
  for (int y = 0; y < 6; ++y) EXPECT_EQ(frame.at<cv::Vec3f>(y, 2)[1], y % 2 == 0 ? 1 : 2);
}

TEST(Blood, CoversTheShareOfTheOrganThatWasAskedFor) {
  const Texture clean = [](const Vec3&, const Vec3&) { return Texel{}; };
  for (const double covered : {0.1, 0.4}) {
    const Texture stained = bloody(clean, {covered, 4}, 3);
    int dark = 0;
    const Surface sphere = make_sphere(5);
    for (const Vec3& direction : sphere.vertices_mm)
      dark += stained(40 * direction, direction).albedo.x() < 0.35f ? 1 : 0;
    EXPECT_NEAR(static_cast<double>(dark) / static_cast<double>(sphere.vertices_mm.size()), covered, 0.05);
  }
}

StereoFrame bad_day(int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  SimulatedLook look;
  look.border = {70, 20};
  look.smoke = {0.7, 0.6};
  look.blood = {0.2, 8};
  const SimulatedCamera camera = small_camera();
  Renderer renderer(camera, look);
  renderer.add(make_organ(SimulatedBody{}, 1200), {bloody(tissue_texture(look), look.blood, look.seed), 3, 0.4, 0.04});
  return recorded(woven(renderer.light(4, 0.16), renderer.light(4, 0.18)), camera, look, 4);
}

TEST(Optics, DrawTheSamePictureForAnyNumberOfThreads) {
  const StereoFrame one = bad_day(1), four = bad_day(4);
  EXPECT_EQ(cv::norm(one.left, four.left, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.right, four.right, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace palpate
