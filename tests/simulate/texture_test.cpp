#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "palpate/core/errors.h"
#include "palpate/simulate/texture.h"

namespace palpate {
namespace {

TEST(Texture, LaysAnImageOnTheSideThatFacesTheCamera) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "palpate_texture.png";
  cv::Mat image(40, 40, CV_8UC3, cv::Scalar(0, 0, 255));  // red,
  image.colRange(20, 40).setTo(cv::Scalar(255, 0, 0));    // blue to the right of its middle
  ASSERT_TRUE(cv::imwrite(file.string(), image));
  SimulatedLook look;
  look.texture = file;
  look.texture_mm_per_px = 0.5;
  const Texture texture = tissue_texture(look);
  const Vec3 towards_camera(0, 0, -1);
  EXPECT_GT(texture({-4, 1, 90}, towards_camera).albedo.x(), 0.99f);
  EXPECT_GT(texture({4, 1, 90}, towards_camera).albedo.z(), 0.99f);
  EXPECT_GT(texture({12, 1, 90}, towards_camera).albedo.z(), 0.99f);  // mirrored beyond its edge
  EXPECT_LT(texture({12, 1, 90}, towards_camera).albedo.x(), 0.01f);
  std::filesystem::remove(file);
}

TEST(Texture, RefusesAnImageThatIsNotThere) {
  SimulatedLook look;
  look.texture = "/nowhere/tissue.png";
  EXPECT_THROW(tissue_texture(look), BadInput);
}

TEST(Texture, ProceduralTissueIsRedAndChangesWithTheSeed) {
  SimulatedLook one, two;
  two.seed = 2;
  const Texture a = tissue_texture(one), b = tissue_texture(two);
  int different = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 at(0.7 * i, 3, 90 - 0.4 * i);
    const Eigen::Vector3f colour = a(at, Vec3::UnitZ()).albedo;
    EXPECT_GT(colour.x(), colour.y());
    EXPECT_GT(colour.y(), 0);
    EXPECT_LT(colour.x(), 1.2f);
    different += (colour - b(at, Vec3::UnitZ()).albedo).norm() > 0.02f;
  }
  EXPECT_GT(different, 60);
}

}  // namespace
}  // namespace palpate
