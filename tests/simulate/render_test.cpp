#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <opencv2/imgproc.hpp>

#include "palpate/simulate/noise.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/render.h"

namespace palpate {
namespace {

SimulatedCamera small_camera() {
  SimulatedCamera camera;
  camera.width = 240;
  camera.height = 160;
  camera.focal_px = 350;
  return camera;
}

SimulatedLook quiet_look() {
  SimulatedLook look;
  look.noise = {0, 0};
  look.light.position_mm = {0, 0, 0};
  look.light.radius_mm = 0;
  return look;
}

Texture white() {
  return [](const Vec3&, const Vec3&) { return Texel{Eigen::Vector3f::Ones(), Eigen::Vector3f::Zero()}; };
}

Surface ball(const Vec3& center, double radius) {
  Surface sphere = make_sphere(4);
  for (Vec3& vertex : sphere.vertices_mm) vertex = center + radius * vertex;
  return sphere;
}

Surface square_facing_the_camera(double depth_mm, double half_mm) {
  Surface square;
  square.vertices_mm = {{-half_mm, -half_mm, depth_mm},
                        {half_mm, -half_mm, depth_mm},
                        {half_mm, half_mm, depth_mm},
                        {-half_mm, half_mm, depth_mm}};
  square.triangles = {{0, 2, 1}, {0, 3, 2}};
  return square;
}

cv::Point2d centroid(const cv::Mat& bgr) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  const cv::Moments m = cv::moments(grey);
  return {m.m10 / m.m00, m.m01 / m.m00};
}

TEST(Renderer, ShowsAPointWhereThePinholeModelSays) {
  const SimulatedCamera camera = small_camera();
  SimulatedLook look = quiet_look();
  look.exposure = 100;  // all of the ball saturates, so that its shading does not move its middle
  for (const Vec3& at : {Vec3(0, 0, 100), Vec3(12, -7, 80), Vec3(-15, 10, 120)}) {
    Renderer renderer(camera, look);
    renderer.add(ball(at, 1.0), {white(), 1, 1.0, 0.0});
    const StereoFrame frame = renderer.render(0);
    const double cx = 119.5, cy = 79.5;
    const cv::Point2d left = centroid(frame.left), right = centroid(frame.right);
    EXPECT_NEAR(left.x, cx + camera.focal_px * at.x() / at.z(), 0.1);
    EXPECT_NEAR(left.y, cy + camera.focal_px * at.y() / at.z(), 0.1);
    EXPECT_NEAR(right.x, cx + camera.focal_px * (at.x() - camera.baseline_mm) / at.z(), 0.1);
    EXPECT_NEAR(left.y - right.y, 0, 0.05);
    EXPECT_NEAR(left.x - right.x, camera.focal_px * camera.baseline_mm / at.z(), 0.1);
  }
}

double middle_level(double depth_mm, double exposure) {
  SimulatedLook look = quiet_look();
  look.exposure = exposure;
  Renderer renderer(small_camera(), look);
  renderer.add(square_facing_the_camera(depth_mm, 40), {white(), 0.1, 1.0, 0.0});
  const cv::Mat left = renderer.render(0).left;
  return left.at<cv::Vec3b>(left.rows / 2, left.cols / 2)[1];
}

// 8-bit sRGB back to linear light; below the shoulder the sensor is sRGB.
double light_of(double level) {
  const double s = level / 255;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

TEST(Renderer, LightFallsWithTheSquareOfTheDistance) {
  const double near = light_of(middle_level(100, 0.4)), far = light_of(middle_level(200, 0.4));
  EXPECT_NEAR(near / far, 4, 0.1);
  // A white surface at the reference distance sends back the exposure (and a little that went around).
  EXPECT_NEAR(light_of(middle_level(105, 0.4)), 0.4, 0.02);
}

TEST(Renderer, CastsShadows) {
  SimulatedLook look = quiet_look();
  look.light.position_mm = {-30, 0, 0};
  Renderer renderer(small_camera(), look);
  renderer.add(square_facing_the_camera(120, 60), {white(), 0.1, 1.0, 0.0});
  renderer.add(ball({0, 0, 80}, 3), {white(), 1, 1.0, 0.0});
  const cv::Mat left = renderer.render(0).left;
  // The ray from the light (x = -27.5) over the ball (x = 0, z = 80) meets the square at x = 13.75.
  const int shadow_x = static_cast<int>(119.5 + 350 * 13.75 / 120);
  EXPECT_LT(left.at<cv::Vec3b>(80, shadow_x)[1], 60);
  EXPECT_GT(left.at<cv::Vec3b>(80, 239 - shadow_x)[1], 120);
}

TEST(Renderer, MasksWhatTheLeftEyeSeesFirst) {
  Renderer renderer(small_camera(), quiet_look());
  const int wall = renderer.add(square_facing_the_camera(120, 100), {white(), 0.1, 1.0, 0.0});
  const int front = renderer.add(ball({0, 0, 80}, 10), {white(), 1, 1.0, 0.0});
  const int pixels_of_ball = cv::countNonZero(renderer.visible_mask(front));
  const double radius_px = 350 * 10 / std::sqrt(80.0 * 80 - 10 * 10);
  EXPECT_NEAR(pixels_of_ball / (CV_PI * radius_px * radius_px), 1, 0.02);
  EXPECT_EQ(cv::countNonZero(renderer.visible_mask(wall)), 240 * 160 - pixels_of_ball);
}

StereoFrame draw_organ(int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  SimulatedLook look;
  Renderer renderer(small_camera(), look);
  SimulatedBody body;
  Surface organ = make_organ(body, 1200);
  const int number = renderer.add(organ, {tissue_texture(look), 4, 0.4, 0.04});
  renderer.add(square_facing_the_camera(150, 100), {wall_texture(1), 0.3, 0.6, 0.03});
  for (Vec3& vertex : organ.vertices_mm) vertex += Vec3(0.3, -0.2, 0.5);
  renderer.move(number, organ.vertices_mm);
  return renderer.render(3);
}

TEST(Renderer, DrawsTheSamePictureForAnyNumberOfThreads) {
  const StereoFrame one = draw_organ(1), four = draw_organ(4);
  EXPECT_EQ(cv::norm(one.left, four.left, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.right, four.right, cv::NORM_INF), 0);
}

TEST(Renderer, TextureMovesWithTheSurface) {
  const auto picture = [](double shift_mm) {
    SimulatedLook look = quiet_look();
    Renderer renderer(small_camera(), look);
    Surface square = square_facing_the_camera(100, 30);
    const int number = renderer.add(square, {tissue_texture(look), 1, 1.0, 0.0});
    for (Vec3& vertex : square.vertices_mm) vertex.x() += shift_mm;
    renderer.move(number, square.vertices_mm);
    return renderer.render(0).left;
  };
  const int shift_px = 7;
  const cv::Mat before = picture(0), after = picture(shift_px * 100 / 350.0);
  const cv::Rect middle(80, 40, 80, 80);
  cv::Mat difference;
  cv::absdiff(before(middle), after(middle + cv::Point(shift_px, 0)), difference);
  EXPECT_LT(cv::mean(difference)[1], 1.0);  // what the light makes of another place
  cv::absdiff(before(middle), after(middle), difference);
  EXPECT_GT(cv::mean(difference)[1], 4.0);
}

TEST(Renderer, NoiseHasTheStatedStrengthAndChangesWithTheFrame) {
  SimulatedLook look = quiet_look();
  look.noise = {2.0, 0};
  look.exposure = 0.3;
  Renderer renderer(small_camera(), look);
  renderer.add(square_facing_the_camera(100, 60), {white(), 0.1, 1.0, 0.0});
  const cv::Rect middle(100, 60, 40, 40);
  cv::Mat difference;
  cv::subtract(renderer.render(0).left(middle), renderer.render(1).left(middle), difference, {}, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(difference, mean, deviation);
  EXPECT_NEAR(mean[1], 0, 0.3);
  EXPECT_NEAR(deviation[1], 2 * std::sqrt(2.0), 0.25);  // with the rounding to whole levels
}

TEST(Noise, HasTheGradientOfItsValues) {
  const float h = 1e-2f;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3f p(0.37f * static_cast<float>(i) - 6, 0.21f * static_cast<float>(i),
                            3 - 0.13f * static_cast<float>(i));
    const FieldValue field = fractal_noise(p, 5, 2);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f step = h * Eigen::Vector3f::Unit(k);
      const float slope = (fractal_noise(p + step, 5, 2).value - fractal_noise(p - step, 5, 2).value) / (2 * h);
      EXPECT_NEAR(field.gradient[k], slope, 0.02f);
    }
  }
}

}  // namespace
}  // namespace palpate
