#pragma once

#include <memory>

#include "palpate/core/geometry.h"
#include "palpate/simulate/optics.h"
#include "palpate/simulate/texture.h"

namespace palpate {

/// How light leaves a surface: Lambert's law with the albedo of the texture, and a rough specular lobe
/// (Trowbridge-Reitz, "GGX"; Walter et al. 2007) with Schlick's Fresnel term.
struct SurfaceLook {
  Texture texture;
  double texels_per_mm = 8;   ///< how finely the texture is sampled, once, when the surface is added
  double roughness = 0.36;    ///< square root of GGX's alpha
  double reflectance = 0.04;  ///< at normal incidence
};

/// Draws surfaces for both cameras with a light near the camera (Embree). Left camera frame. Keeps the ray tracing tree
/// and the sampled textures; textures stick to the rest shape and move with the surface.
class Renderer {
 public:
  Renderer(const SimulatedCamera& camera, const SimulatedLook& look);
  ~Renderer();
  Renderer(Renderer&&) noexcept;

  /// Adds a surface at rest, in place, and returns its number (0, 1, ...).
  int add(const Surface& rest, const SurfaceLook& look);

  /// New places of all vertices of a surface.
  void move(int surface, const std::vector<Vec3>& vertices_mm);

  /// Light that arrives at both cameras at a moment, with anti-aliasing and smoke. The same for any number of threads;
  /// `index` is the frame and seeds the points of the light that cast shadows.
  StereoLight light(int index, double time_s);

  /// Both images of a frame as recorded, 8-bit BGR.
  StereoFrame render(int index);

  /// 255 where an camera (0 left, 1 right) sees this surface before all others.
  cv::Mat visible_mask(int surface, int side = 0);

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace palpate
