#include "palpate/simulate/baked_texture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

const int kMostSteps = 64;

// Rows of constant v, row j with steps + 1 - j texels.
int place(int steps, int i, int j) {
  return j * (steps + 1) - j * (j - 1) / 2 + i;
}

int texel_count(int steps) {
  return (steps + 1) * (steps + 2) / 2;
}

}  // namespace

BakedTexture::BakedTexture(const Surface& rest, const Texture& texture, double texels_per_mm) {
  const std::vector<Vec3> normals = vertex_normals(rest.vertices_mm, rest.triangles);
  int total = 0;
  for (const auto& [a, b, c] : rest.triangles) {
    const Vec3& pa = rest.vertices_mm[static_cast<size_t>(a)];
    const Vec3& pb = rest.vertices_mm[static_cast<size_t>(b)];
    const Vec3& pc = rest.vertices_mm[static_cast<size_t>(c)];
    const double longest = std::max({(pb - pa).norm(), (pc - pb).norm(), (pa - pc).norm()});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest * texels_per_mm)), 1, kMostSteps);
    grids_.push_back({total, steps});
    total += texel_count(steps);
  }
  texels_.resize(static_cast<size_t>(total));
  tbb::parallel_for(size_t{0}, rest.triangles.size(), [&](size_t t) {
    const Grid& grid = grids_[t];
    const auto corner = [&](const std::vector<Vec3>& values, size_t k) -> const Vec3& {
      return values[static_cast<size_t>(rest.triangles[t][k])];
    };
    const auto between = [&](const std::vector<Vec3>& values, double u, double v) -> Vec3 {
      return (1 - u - v) * corner(values, 0) + u * corner(values, 1) + v * corner(values, 2);
    };
    for (int j = 0; j <= grid.steps; ++j)
      for (int i = 0; i + j <= grid.steps; ++i) {
        const double u = static_cast<double>(i) / grid.steps, v = static_cast<double>(j) / grid.steps;
        texels_[static_cast<size_t>(grid.first + place(grid.steps, i, j))] =
            texture(between(rest.vertices_mm, u, v), between(normals, u, v).normalized());
      }
  });
}

Texel BakedTexture::at(int triangle, float u, float v) const {
  const Grid& grid = grids_[static_cast<size_t>(triangle)];
  const float x = std::clamp(u, 0.0f, 1.0f) * static_cast<float>(grid.steps);
  const float y = std::clamp(v, 0.0f, 1.0f) * static_cast<float>(grid.steps);
  const int j = std::min(static_cast<int>(y), grid.steps - 1);
  const int i = std::min(static_cast<int>(x), grid.steps - 1 - j);
  float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  const auto texel = [&](int a, int b) -> const Texel& {
    return texels_[static_cast<size_t>(grid.first + place(grid.steps, a, b))];
  };
  const bool upper = fx + fy > 1 && i + j + 2 <= grid.steps;
  const Texel& p = upper ? texel(i + 1, j + 1) : texel(i, j);
  const Texel& q = upper ? texel(i, j + 1) : texel(i + 1, j);
  const Texel& r = upper ? texel(i + 1, j) : texel(i, j + 1);
  if (upper) {
    fx = 1 - fx;
    fy = 1 - fy;
  }
  Texel mixed;
  mixed.albedo = p.albedo + fx * (q.albedo - p.albedo) + fy * (r.albedo - p.albedo);
  mixed.slope = p.slope + fx * (q.slope - p.slope) + fy * (r.slope - p.slope);
  return mixed;
}

}  // namespace palpate
