#include "palpate/infer/scene_motion.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace palpate {

Mat3 SceneMotion::rotation() const {
  const double angle = rotation_rad.norm();
  if (angle < 1e-12) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, rotation_rad / angle).toRotationMatrix();
}

Mat3 SceneMotion::linear() const {
  Mat3 stretch = Mat3::Identity();
  stretch.topLeftCorner<2, 2>() << 1 + strain.x(), strain.z(), strain.z(), 1 + strain.y();
  return rotation() * stretch;
}

Vec3 SceneMotion::apply(const Vec3& in_map_mm) const {
  return about_mm + translation_mm + linear() * (in_map_mm - about_mm);
}

Vec3 SceneMotion::undo(const Vec3& now_mm) const {
  return about_mm + linear().inverse() * (now_mm - about_mm - translation_mm);
}

}  // namespace palpate
