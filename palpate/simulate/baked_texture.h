#pragma once

#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/simulate/texture.h"

namespace palpate {

/// A texture sampled once on a regular grid inside every triangle, so that looking it up costs three reads. Works for
/// any surface without unfolding it.
class BakedTexture {
 public:
  /// `texels_per_mm` along the longest edge of each triangle of the surface at rest; at least its corners.
  BakedTexture(const Surface& rest, const Texture& texture, double texels_per_mm);

  /// Linear interpolation at barycentric weights (1 - u - v, u, v) of the triangle's corners.
  Texel at(int triangle, float u, float v) const;

 private:
  struct Grid {
    int first = 0;  // of texels_
    int steps = 1;  // along an edge
  };
  std::vector<Grid> grids_;
  std::vector<Texel> texels_;
};

}  // namespace palpate
