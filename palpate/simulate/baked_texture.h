#pragma once

#include <atomic>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/simulate/texture.h"

namespace palpate {

/// A texture sampled once on a regular grid inside every triangle, so that looking it up costs three reads. Works for
/// any surface without unfolding it. A triangle is sampled when it is first looked at, by whichever thread: most of a
/// surface is never seen.
class BakedTexture {
 public:
  /// `texels_per_mm` along the longest edge of each triangle of the surface at rest; at least its corners.
  BakedTexture(const Surface& rest, const Texture& texture, double texels_per_mm);

  /// Three texels and how they mix.
  struct Spot {
    const Texel *p, *q, *r;
    float toward_q, toward_r;

    Texel texel() const;
  };

  /// Where barycentric weights (1 - u - v, u, v) of the triangle's corners lie. Also asks the memory for the texels, so
  /// that finding several spots before the first is read does not wait for each.
  Spot spot(int triangle, float u, float v) const;

  /// Linear interpolation there.
  Texel at(int triangle, float u, float v) const { return spot(triangle, u, v).texel(); }

 private:
  enum class State : unsigned char { unknown, in_work, known };
  struct Grid {
    int first = 0;             // of texels_
    unsigned short steps = 1;  // along an edge
    mutable std::atomic<State> state = State::unknown;
  };

  void bake(size_t triangle) const;

  Surface rest_;
  std::vector<Vec3> normals_;
  Texture texture_;
  std::vector<Grid> grids_;
  mutable std::vector<Texel> texels_;
};

}  // namespace palpate
