#pragma once

#include <optional>

#include "palpate/core/geometry.h"

namespace palpate {

/// A rigid motion of a given body into the left camera frame, and how well it then fits what the camera measured.
struct Registration {
  Mat3 left_from_volume = Mat3::Identity();
  Vec3 left_from_volume_mm = Vec3::Zero();  ///< p_left = left_from_volume * p + left_from_volume_mm
  double residual_mm = 0;                   ///< root mean square distance of the matched points to the body
  double matched_fraction = 0;              ///< of the points: near a side of the body that looks at the camera

  Vec3 apply(const Vec3& p) const { return left_from_volume * p + left_from_volume_mm; }
};

/// Iterative closest points (point to plane; Chen and Medioni 1992) of points seen by the camera onto the faces of a
/// closed body that look at the camera; points that find no face there, and outliers, lose their weight. From `start`,
/// or from equal middles with several turns about them. Always returns the best that was found: judge it by its
/// residual and share.
Registration register_body(const Surface& body, const std::vector<Vec3>& seen_mm,
                           const std::optional<Registration>& start = {});

}  // namespace palpate
