#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace palpate {

/// Outgoing over incoming light of a rough specular lobe (Trowbridge-Reitz, "GGX", with Smith's masking and Schlick's
/// Fresnel term), times pi and the cosine at the light, so that it adds to albedo times cosine. Unit vectors;
/// `reflectance` at normal incidence.
inline float specular(const Eigen::Vector3f& n, const Eigen::Vector3f& to_light, const Eigen::Vector3f& to_camera,
                      float alpha, float reflectance) {
  const float n_l = n.dot(to_light), n_v = std::max(1e-3f, n.dot(to_camera));
  if (n_l <= 0) return 0;
  const Eigen::Vector3f half = (to_light + to_camera).normalized();
  const float n_h = std::max(0.0f, n.dot(half)), v_h = std::max(0.0f, to_camera.dot(half));
  const float a2 = alpha * alpha;
  const float d = n_h * n_h * (a2 - 1) + 1;
  const float distribution = a2 / (d * d);
  const auto masking = [a2](float c) { return 2 * c / (c + std::sqrt(a2 + (1 - a2) * c * c)); };
  const float m = 1 - v_h;
  const float fresnel = reflectance + (1 - reflectance) * m * m * m * m * m;
  return distribution * masking(n_l) * masking(n_v) * fresnel / (4 * n_v);
}

}  // namespace palpate
