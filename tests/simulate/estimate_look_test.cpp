#include "palpate/simulate/estimate_look.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/ray_scene.h"
#include "palpate/simulate/render.h"

namespace palpate {
namespace {

SimulatedCamera camera() {
  SimulatedCamera c;
  c.width = 480;
  c.height = 270;
  c.focal_px = 350;
  return c;
}

Camera calibrated() {
  const SimulatedCamera c = camera();
  Camera left;
  left.K = {c.focal_px, 0, 0.5 * (c.width - 1), 0, c.focal_px, 0.5 * (c.height - 1), 0, 0, 1};
  return left;
}

Surface organ() {
  SimulatedBody body;
  body.center_mm = {0, 0, 95};
  body.rotation_deg = {-15, 10, 12};
  return make_organ(body, 5000);
}

cv::Mat picture(const SimulatedLook& look, const Texture& texture) {
  Renderer renderer(camera(), look);
  renderer.add(organ(), {texture, 4, look.roughness, look.reflectance});
  return renderer.render(0).left;
}

// Albedo of the texture where the left camera sees it, linear BGR; black elsewhere.
cv::Mat true_albedo(const Texture& texture) {
  const Surface surface = organ();
  RayScene rays;
  rays.add(surface.triangles, surface.vertices_mm.size());
  rays.place(0, surface.vertices_mm);
  rays.commit();
  const std::vector<Vec3> normals = vertex_normals(surface.vertices_mm, surface.triangles);
  const SimulatedCamera c = camera();
  cv::Mat albedo(c.height, c.width, CV_32FC3, cv::Scalar::all(0));
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      const Eigen::Vector3f ray(static_cast<float>((x - 0.5 * (c.width - 1)) / c.focal_px),
                                static_cast<float>((y - 0.5 * (c.height - 1)) / c.focal_px), 1);
      const RayHit hit = rays.first_hit(Eigen::Vector3f::Zero(), ray);
      if (hit.surface < 0) continue;
      const Vec3 point = (hit.length * ray).cast<double>();
      const Vec3 normal = normals[static_cast<size_t>(surface.triangles[static_cast<size_t>(hit.triangle)][0])];
      const Eigen::Vector3f rgb = texture(point, normal).albedo;
      albedo.at<cv::Vec3f>(y, x) = {rgb.z(), rgb.y(), rgb.x()};
    }
  return albedo;
}

class TakenLook : public ::testing::TestWithParam<Vec3> {};

TEST_P(TakenLook, FindsLightAndGlossOfAPictureWhoseTruthIsKnown) {
  SimulatedLook look;
  look.light.position_mm = GetParam();
  look.roughness = 0.42;
  look.reflectance = 0.05;
  const Vec3 light_mm = look.light.position_mm + Vec3(camera().baseline_mm / 2, 0, 0);
  const EstimatedLook found = estimate_look(picture(look, tissue_texture(look)), calibrated(), organ(), look);
  EXPECT_LT((found.light_mm - light_mm).norm(), 5.5);
  EXPECT_NEAR(found.roughness, look.roughness, 0.08);
  EXPECT_NEAR(found.reflectance, look.reflectance, 0.015);
}

INSTANTIATE_TEST_SUITE_P(Lights, TakenLook, ::testing::Values(Vec3(-5, -7, 0), Vec3(12, 4, 0), Vec3(-18, 10, 5)));

TEST(TakenAlbedo, IsFreeOfShadingAndHighlights) {
  SimulatedLook look;
  look.light.position_mm = {-14, -8, 0};
  const Texture texture = tissue_texture(look);
  const cv::Mat image = picture(look, texture), truth = true_albedo(texture);
  const EstimatedLook found = estimate_look(image, calibrated(), organ(), look);
  cv::Mat inner;
  cv::erode(found.seen, inner, cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31}));
  // Means over 12 px, so that bumps and grain do not count: shading is what is broad.
  cv::Mat estimated, expected;
  cv::blur(found.albedo, estimated, {12, 12});
  cv::blur(truth, expected, {12, 12});
  std::vector<double> errors;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (inner.at<uchar>(y, x) != 0)
        errors.push_back(std::abs(std::log(estimated.at<cv::Vec3f>(y, x)[2] / expected.at<cv::Vec3f>(y, x)[2])));
  ASSERT_GT(errors.size(), 10000u);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.1);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.16);
}

TEST(TakenAlbedo, RefusesASurfaceThatTheImageDoesNotShow) {
  Surface elsewhere = organ();
  for (Vec3& vertex : elsewhere.vertices_mm) vertex.x() += 500;
  EXPECT_THROW(estimate_look(cv::Mat(270, 480, CV_8UC3, cv::Scalar::all(90)), calibrated(), elsewhere, {}), BadInput);
}

}  // namespace
}  // namespace palpate
