#include "palpate/core/kabsch.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace palpate {
namespace {

TEST(RotationOnto, FindsTheRotationBetweenTwoSetsOfVectors) {
  const Mat3 truth = Eigen::AngleAxisd(2.4, Vec3(1, -3, 2).normalized()).toRotationMatrix();
  const std::vector<Vec3> from = {{1, 0, 0.5}, {0, 2, 0}, {-1, 1, 3}};
  std::vector<Vec3> to;
  for (const Vec3& v : from) to.push_back(truth * v);
  EXPECT_LT((rotation_onto(from, to) - truth).norm(), 1e-12);
}

TEST(RotationOnto, IsARotationAlsoWhereAMirrorImageWouldFitBetter) {
  const std::vector<Vec3> from = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, mirrored = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
  EXPECT_NEAR(rotation_onto(from, mirrored).determinant(), 1, 1e-12);
}

}  // namespace
}  // namespace palpate
