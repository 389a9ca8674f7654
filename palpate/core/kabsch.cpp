#include "palpate/core/kabsch.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace palpate {

Mat3 rotation_onto(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  Mat3 H = Mat3::Zero();
  for (size_t i = 0; i < from.size(); ++i) H += from[i] * to[i].transpose();
  const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 signs = Vec3::Ones();
  if ((svd.matrixV() * svd.matrixU().transpose()).determinant() < 0) signs.z() = -1;
  return svd.matrixV() * signs.asDiagonal() * svd.matrixU().transpose();
}

}  // namespace palpate
