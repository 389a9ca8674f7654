#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// Motion of the scene since the map frame: x = about + translation + exp(rotation) (1 + strain) (y - about). What
/// holds the tissue stretches as it breathes.
struct SceneMotion {
  Vec3 translation_mm = Vec3::Zero();
  Vec3 rotation_rad = Vec3::Zero();
  Vec3 about_mm = Vec3::Zero();
  Vec3 strain = Vec3::Zero();  ///< xx, yy, xy of the left camera frame

  Mat3 rotation() const;
  /// exp(rotation) (1 + strain).
  Mat3 linear() const;
  Vec3 apply(const Vec3& in_map_mm) const;
  Vec3 undo(const Vec3& now_mm) const;
};

}  // namespace palpate
