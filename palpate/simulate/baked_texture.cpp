#include "palpate/simulate/baked_texture.h"

#include <algorithm>
#include <cmath>
#include <thread>

namespace palpate {
namespace {

const int kMaxSteps = 64;

// Rows of constant v, row j with steps + 1 - j texels.
int place(int steps, int i, int j) {
  return j * (steps + 1) - j * (j - 1) / 2 + i;
}

int texel_count(int steps) {
  return (steps + 1) * (steps + 2) / 2;
}

}  // namespace

BakedTexture::BakedTexture(const Surface& rest, const Texture& texture, double texels_per_mm)
    : rest_(rest),
      normals_(vertex_normals(rest.vertices_mm, rest.triangles)),
      texture_(texture),
      grids_(rest.triangles.size()) {
  int total = 0;
  for (size_t t = 0; t < grids_.size(); ++t) {
    const auto corner = [&](size_t k) -> const Vec3& {
      return rest.vertices_mm[static_cast<size_t>(rest.triangles[t][k])];
    };
    const double longest =
        std::max({(corner(1) - corner(0)).norm(), (corner(2) - corner(1)).norm(), (corner(0) - corner(2)).norm()});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest * texels_per_mm)), 1, kMaxSteps);
    grids_[t].first = total;
    grids_[t].steps = static_cast<unsigned short>(steps);
    total += texel_count(steps);
  }
  texels_.resize(static_cast<size_t>(total));
}

void BakedTexture::bake(size_t triangle) const {
  const Grid& grid = grids_[triangle];
  State expected = State::unknown;
  if (!grid.state.compare_exchange_strong(expected, State::in_work)) {
    while (grid.state.load(std::memory_order_acquire) != State::known) std::this_thread::yield();
    return;
  }
  const auto corner = [&](const std::vector<Vec3>& values, size_t k) -> const Vec3& {
    return values[static_cast<size_t>(rest_.triangles[triangle][k])];
  };
  const auto between = [&](const std::vector<Vec3>& values, double u, double v) -> Vec3 {
    return (1 - u - v) * corner(values, 0) + u * corner(values, 1) + v * corner(values, 2);
  };
  const int steps = grid.steps;
  for (int j = 0; j <= steps; ++j)
    for (int i = 0; i + j <= steps; ++i) {
      const double u = static_cast<double>(i) / steps, v = static_cast<double>(j) / steps;
      const int at = grid.first + place(steps, i, j);
      texels_[static_cast<size_t>(at)] =
          texture_(between(rest_.vertices_mm, u, v), between(normals_, u, v).normalized());
    }
  grid.state.store(State::known, std::memory_order_release);
}

BakedTexture::Spot BakedTexture::spot(int triangle, float u, float v) const {
  const Grid& grid = grids_[static_cast<size_t>(triangle)];
  if (grid.state.load(std::memory_order_acquire) != State::known) bake(static_cast<size_t>(triangle));
  const int steps = grid.steps;
  const float x = std::clamp(u, 0.0f, 1.0f) * static_cast<float>(steps);
  const float y = std::clamp(v, 0.0f, 1.0f) * static_cast<float>(steps);
  const int j = std::min(static_cast<int>(y), steps - 1);
  const int i = std::min(static_cast<int>(x), steps - 1 - j);
  const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  const auto texel = [&](int a, int b) {
    const int at = grid.first + place(steps, a, b);
    return &texels_[static_cast<size_t>(at)];
  };
  const bool upper = fx + fy > 1 && i + j + 2 <= steps;
  const Spot found = upper ? Spot{texel(i + 1, j + 1), texel(i, j + 1), texel(i + 1, j), 1 - fx, 1 - fy}
                           : Spot{texel(i, j), texel(i + 1, j), texel(i, j + 1), fx, fy};
  __builtin_prefetch(found.p);
  __builtin_prefetch(found.q);
  __builtin_prefetch(found.r);
  return found;
}

Texel BakedTexture::Spot::texel() const {
  Texel mixed;
  mixed.albedo = p->albedo + toward_q * (q->albedo - p->albedo) + toward_r * (r->albedo - p->albedo);
  mixed.slope = p->slope + toward_q * (q->slope - p->slope) + toward_r * (r->slope - p->slope);
  return mixed;
}

}  // namespace palpate
