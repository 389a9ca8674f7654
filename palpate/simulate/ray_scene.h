#pragma once

#include <array>
#include <memory>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

struct RayHit {
  int surface = -1;  ///< -1 = nothing
  int triangle = -1;
  float u = 0;       ///< barycentric weight of the second corner
  float v = 0;       ///< of the third
  float length = 0;  ///< of the ray, in units of its direction
};

/// Neighbouring rays are traced together.
inline constexpr int kBundle = 16;
template <class T>
using Bundle = std::array<T, kBundle>;

/// Triangle surfaces and where rays meet them (Embree 3 or 4), mm.
class RayScene {
 public:
  RayScene();
  ~RayScene();
  RayScene(RayScene&&) noexcept;

  /// Surfaces are numbered 0, 1, ...; `place` gives their vertices.
  int add(const std::vector<Triangle>& triangles, size_t vertex_count);
  void place(int surface, const std::vector<Vec3>& vertices_mm);
  /// To be called after every change, before rays are traced.
  void commit();

  RayHit first_hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  void first_hits(const Eigen::Vector3f& origin, const Bundle<Eigen::Vector3f>& directions, Bundle<RayHit>& hits) const;
  /// Whether something stands between the two points, asked only where `wanted`; false elsewhere.
  Bundle<bool> blocked(const Bundle<bool>& wanted, const Bundle<Eigen::Vector3f>& from,
                       const Bundle<Eigen::Vector3f>& to) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace palpate
