#include "palpate/stereo/write_rig.h"

#include <Eigen/Geometry>

#include "tests/stereo/files.h"

namespace palpate {
namespace {

StereoRig some_rig(LensModel lens, std::vector<double> distortion) {
  StereoRig rig;
  rig.left.K = {701.5, 0, 481.25, 0, 699.75, 268.5, 0, 0, 1};
  rig.right.K = {703, 0, 478, 0, 702, 271, 0, 0, 1};
  rig.left.distortion = distortion;
  for (double& value : distortion) value *= 0.9;
  rig.right.distortion = distortion;
  rig.left.lens = rig.right.lens = lens;
  rig.right_from_left = Eigen::AngleAxisd(0.03, Vec3(0.2, 1, -0.1).normalized()).toRotationMatrix();
  rig.right_from_left_mm = {-5.25, 0.125, -0.0625};
  return rig;
}

TEST(WrittenRig, IsReadBackAsItWas) {
  const test::TemporaryFolder folder;
  for (const StereoRig& rig : {some_rig(LensModel::brown, {-0.31, 0.14, 0.001, -0.002, 0.02}),
                               some_rig(LensModel::brown, {0.1, 0.2, 0.001, 0.002, 0.03, 0.15, 0.25, 0.01}),
                               some_rig(LensModel::fisheye, {-0.02, 0.05, -0.03, 0.006})}) {
    write_rig(folder / "calibration.yaml", rig, {960, 540});
    const StereoRig read = read_rig(folder / "calibration.yaml");
    EXPECT_EQ(read.image_size, cv::Size(960, 540));
    for (const auto& [a, b] : {std::pair(rig.left, read.left), std::pair(rig.right, read.right)}) {
      EXPECT_EQ(a.lens, b.lens);
      EXPECT_EQ(cv::norm(a.K, b.K), 0);
      ASSERT_EQ(a.distortion.size(), b.distortion.size());
      for (size_t i = 0; i < a.distortion.size(); ++i) EXPECT_NEAR(a.distortion[i], b.distortion[i], 1e-12);
    }
    EXPECT_LT((rig.right_from_left - read.right_from_left).norm(), 1e-12);
    EXPECT_LT((rig.right_from_left_mm - read.right_from_left_mm).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace palpate
