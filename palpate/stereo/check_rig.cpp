#include "palpate/stereo/check_rig.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <cmath>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

constexpr double kMinBaseline_mm = 1, kMaxBaseline_mm = 200;
/// Of R^T R from the identity: what three decimals leave.
constexpr double kLargestSkew = 1e-3;

void check_camera(const Camera& camera, const std::string& name, const std::string& file) {
  const double fx = camera.K(0, 0), fy = camera.K(1, 1);
  if (!(fx > 50 && fx < 20000 && fy > 50 && fy < 20000))
    throw BadInput(fmt::format("{}: focal length of the {} camera is {:.6g} x {:.6g} px, expected 50 to 20000 px", file,
                               name, fx, fy));
  if (fx / fy > 2 || fy / fx > 2)
    throw BadInput(
        fmt::format("{}: focal lengths of the {} camera are {:.6g} and {:.6g} px, expected nearly the same in x and y",
                    file, name, fx, fy));
  const size_t count = camera.distortion.size();
  if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12 && count != 14)
    throw BadInput(
        fmt::format("{}: the {} camera has {} distortion coefficients, expected 4, 5, 8, 12 or 14 (k1 k2 p1 p2 k3 ...)",
                    file, name, count));
  for (const double coefficient : camera.distortion)
    if (!std::isfinite(coefficient))
      throw BadInput(fmt::format("{}: a distortion coefficient of the {} camera is not a number", file, name));
}

double skew_of(const Mat3& R) {
  const double skew = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  return R.determinant() < 0 ? std::max(skew, 2.0) : skew;
}

/// "; it would be one if R[1,2] = 0.012 had the opposite sign", of a number that was typed wrong.
std::string sign_that_is_wrong(const Mat3& R) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      Mat3 other = R;
      other(row, column) *= -1;
      if (R(row, column) != 0 && skew_of(other) < kLargestSkew)
        return fmt::format("; it would be one if R[{},{}] = {:.6g} (row {}, column {}) had the opposite sign", row,
                           column, R(row, column), row + 1, column + 1);
    }
  return {};
}

}  // namespace

void check_rig(const StereoRig& rig) {
  const std::string file = rig.file.string();
  check_camera(rig.left, "left", file);
  check_camera(rig.right, "right", file);
  const Mat3& R = rig.right_from_left;
  if (!(skew_of(R) < kLargestSkew))
    throw BadInput(
        fmt::format("{}: R is not a rotation (R^T R differs from the identity by {:.3g}, determinant {:.3g}; "
                    "expected less than {:g} and 1){}",
                    file, (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff(), R.determinant(), kLargestSkew,
                    sign_that_is_wrong(R)));
  const double baseline = rig.baseline_mm();
  if (!(baseline >= kMinBaseline_mm && baseline <= kMaxBaseline_mm))
    throw BadInput(fmt::format(
        "{}: the baseline (length of T) is {:.6g} mm, expected {:g} to {:g} mm; is recording.translation_unit right?",
        file, baseline, kMinBaseline_mm, kMaxBaseline_mm));
  const Vec3 right_camera_in_left_mm = -R.transpose() * rig.right_from_left_mm;
  if (right_camera_in_left_mm.x() < 0 && -right_camera_in_left_mm.x() > 0.5 * baseline)
    throw BadInput(
        fmt::format("{}: T puts the right camera {:.3g} mm to the left of the left camera, expected T[0] < 0 (x_right "
                    "= R x_left + T); "
                    "the two cameras of the calibration are exchanged or T has the opposite sign",
                    file, -right_camera_in_left_mm.x()));
  if (right_camera_in_left_mm.x() < 0.5 * baseline)
    throw BadInput(fmt::format("{}: T is [{:.4g}, {:.4g}, {:.4g}] mm, expected cameras side by side (T mainly along x)",
                               file, rig.right_from_left_mm.x(), rig.right_from_left_mm.y(),
                               rig.right_from_left_mm.z()));
}

}  // namespace palpate
