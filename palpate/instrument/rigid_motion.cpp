#include "palpate/instrument/rigid_motion.h"

#include <tbb/parallel_invoke.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace palpate {

namespace {

// Translation of the tip, rotation about it, and how far the right camera's rows have moved against the left camera's.
constexpr int kUnknowns = 7;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

// Colour is recorded at half resolution: the outline guides from afar, the texture decides.
constexpr LayerNoise kNoise{3, 80};
constexpr double kRotationDeviation_rad = 0.02;  // an instrument in a trocar mostly translates
// Light slides over a round shaft as it moves, differently for each camera: a shift across the shaft, which an almost
// level shaft would turn into a disparity many times as large.
constexpr double kRowDeviation_px = 1.0;
// A long way needs what the rows say about the depth of such a shaft.
constexpr double kRowDeviationOfLongWay_px = 0.02;
constexpr double kMinAgreement = 0.35;
constexpr double kMinMetal = 0.6;
constexpr double kCorrelatedNoise = 12;

struct System {
  Normal normal = Normal::Zero();
  Unknowns right = Unknowns::Zero();
  double information = 0, full_information = 0, squared_error = 0, weight = 0;
  double agreement() const { return full_information > 0 ? information / full_information : 0; }

  System& operator+=(const System& other) {
    normal += other.normal;
    right += other.right;
    information += other.information;
    full_information += other.full_information;
    squared_error += other.squared_error;
    weight += other.weight;
    return *this;
  }
};

/// Where one camera sees the instrument; `shift_mm` is the camera's place along the baseline.
struct MotionCamera {
  const Rectification& rectification;
  double shift_mm;

  bool sees_row_offset() const { return shift_mm > 0; }

  /// Point of the keyframe's instrument at a pixel of this camera.
  Vec3 point(const InstrumentPlane& plane, const cv::Point2d& px, double height_px) const {
    const double f = rectification.focal_px;
    double disparity = plane.disparity_at(px);
    double left_x = px.x;
    if (shift_mm > 0) {  // the plane is given in left pixels: x_left = x_right + d(x_left, y)
      disparity = plane.disparity_at(px) / (1 - plane.disparity[1]);
      left_x += disparity;
    }
    const double z = f * rectification.baseline_mm / std::max(disparity * (1 + height_px / f), 0.1);
    return {(left_x - rectification.principal_x_px) * z / f, (px.y - rectification.principal_y_px) * z / f, z};
  }

  cv::Point2d project(const Vec3& p) const {
    const double f = rectification.focal_px;
    return {f * (p.x() - shift_mm) / p.z() + rectification.principal_x_px,
            f * p.y() / p.z() + rectification.principal_y_px};
  }
};

Vec3 moved(const Vec3& point, const Vec3& tip, const Unknowns& p) {
  return point + p.head<3>() + p.segment<3>(3).cross(point - tip);
}

CellWarp warp_of(const PatchCell& cell, const MotionCamera& camera, const InstrumentKeyframe& keyframe,
                 const Unknowns& p) {
  const cv::Point2d row_offset(0, camera.sees_row_offset() ? p[kUnknowns - 1] : 0);
  const auto goes_to = [&](const cv::Point2d& px) {
    const Vec3 x = camera.point(keyframe.plane, px, cell.height_px);
    return px + camera.project(moved(x, keyframe.tip_mm, p)) - camera.project(x) + row_offset;
  };
  CellWarp warp;
  warp.center_px = goes_to(cell.center_px);
  const cv::Point2d along_x = goes_to(cell.center_px + cv::Point2d(4, 0)) - warp.center_px;
  const cv::Point2d along_y = goes_to(cell.center_px + cv::Point2d(0, 4)) - warp.center_px;
  warp.linear = {along_x.x / 4, along_y.x / 4, along_x.y / 4, along_y.y / 4};
  return warp;
}

/// Share of the cells inside the outline that still lie on metal.
double metal_fraction(const std::vector<PatchCell>& cells, const MotionCamera& camera,
                      const InstrumentKeyframe& keyframe, const ImageLayers& layers, const Unknowns& p) {
  int inside = 0, metal = 0;
  for (const PatchCell& cell : cells) {
    if (cell.outline) continue;
    ++inside;
    const cv::Point at(warp_of(cell, camera, keyframe, p).center_px - cv::Point2d(layers.region.tl()));
    if (cv::Rect({}, layers.region.size()).contains(at) && layers.metal[0].at<float>(at) >= 128) ++metal;
  }
  return inside > 0 ? static_cast<double>(metal) / inside : 0;
}

void add_camera(const std::vector<PatchCell>& cells, const MotionCamera& camera, const InstrumentKeyframe& keyframe,
                const ImageLayers& layers, int level, const Unknowns& p, Light light, System& system) {
  const double f = camera.rectification.focal_px;
  for (const PatchCell& cell : cells) {
    const Vec3 before = camera.point(keyframe.plane, cell.center_px, cell.height_px);
    const Vec3 now = moved(before, keyframe.tip_mm, p);
    if (now.z() < 5) continue;
    const CellEquations e = cell_equations(cell, layers, level, warp_of(cell, camera, keyframe, p), kNoise, light);
    Eigen::Matrix<double, 2, 3> projection;
    projection << f / now.z(), 0, -f * (now.x() - camera.shift_mm) / (now.z() * now.z()), 0, f / now.z(),
        -f * now.y() / (now.z() * now.z());
    const Vec3 arm = before - keyframe.tip_mm;
    Mat3 turning;  // d(omega x arm) / d omega
    turning << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
    Eigen::Matrix<double, 2, kUnknowns> jacobian;
    jacobian << projection, projection * turning, Eigen::Vector2d(0, camera.sees_row_offset() ? 1 : 0);
    system.normal += jacobian.transpose() * e.normal * jacobian;
    system.right += jacobian.transpose() * e.right;
    system.information += e.information;
    system.full_information += e.full_information;
    system.squared_error += e.squared_error;
    system.weight += e.weight;
  }
}

}  // namespace

std::optional<RigidMotion> measure_motion(const InstrumentKeyframe& keyframe, const ImageLayers& left,
                                          const ImageLayers& right, const Rectification& rectification,
                                          const RigidMotion& guess, Light light) {
  if (left.region.area() == 0 || right.region.area() == 0) return {};
  const MotionCamera left_camera{rectification, 0}, right_camera{rectification, rectification.baseline_mm};
  Unknowns p;
  p << guess.translation_mm, guess.rotation_rad, 0;
  Normal prior = Normal::Zero();
  prior.diagonal().segment<3>(3).setConstant(kCorrelatedNoise / std::pow(kRotationDeviation_rad, 2));
  prior(kUnknowns - 1, kUnknowns - 1) =
      kCorrelatedNoise / std::pow(light == Light::offset ? kRowDeviationOfLongWay_px : kRowDeviation_px, 2);
  System system;
  for (int level = ImageLayers::kLevels - 1; level >= 0; --level)
    for (int pass = 0; pass < 8; ++pass) {
      const auto cells_at = [level](const PatchTemplate& camera) -> const auto& {
        return camera.cells[static_cast<size_t>(level)];
      };
      system = System();
      System of_right;
      tbb::parallel_invoke(
          [&] { add_camera(cells_at(keyframe.left), left_camera, keyframe, left, level, p, light, system); },
          [&] { add_camera(cells_at(keyframe.right), right_camera, keyframe, right, level, p, light, of_right); });
      system += of_right;
      const Normal normal = system.normal + prior + 1e-6 * Normal::Identity();
      const Unknowns step = normal.ldlt().solve(system.right - prior * p);
      p += step;
      if (!p.allFinite()) return {};
      if (step.head<3>().norm() < 0.002) break;
    }
  if (system.agreement() < kMinAgreement ||
      metal_fraction(keyframe.left.cells[0], left_camera, keyframe, left, p) < kMinMetal ||
      metal_fraction(keyframe.right.cells[0], right_camera, keyframe, right, p) < kMinMetal)
    return {};
  RigidMotion motion;
  motion.translation_mm = p.head<3>();
  motion.rotation_rad = p.segment<3>(3);
  motion.agreement = system.agreement();
  const double noise = std::max(0.1, system.squared_error / std::max(system.weight, 1.0));
  motion.covariance_mm2 = kCorrelatedNoise * noise * (system.normal + prior).inverse().topLeftCorner<3, 3>();
  return motion;
}

}  // namespace palpate
