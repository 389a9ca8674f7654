#include "palpate/simulate/render.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "palpate/simulate/baked_texture.h"
#include "palpate/simulate/noise.h"
#include "palpate/simulate/ray_scene.h"
#include "palpate/simulate/shading.h"

namespace palpate {
namespace {

using Vec3f = Eigen::Vector3f;

const float kShadowStart_mm = 0.05f;  // shadow rays leave the surface by this much
const float kAmbient = 0.015f;        // light that has been around in the cavity
const float kSameDepth = 0.02f;       // neighbouring samples belong together when their depths differ by less
const float kBrightest = 2;           // a highlight counts no more than this where surfaces meet

struct DrawnSurface {
  std::vector<Triangle> triangles;
  std::vector<Vec3f> normals;
  BakedTexture texture;
  float alpha = 0.1f;
  float reflectance = 0.04f;
};

struct Sample {
  Vec3f colour = Vec3f::Zero();
  int surface = -1;
  float depth_mm = std::numeric_limits<float>::infinity();
};

struct Lit {
  Vec3f around = Vec3f::Zero();  // light that came by way of the cavity
  Vec3f direct = Vec3f::Zero();  // light from the scope, if nothing stands in between
  bool faces_light = false;
  Vec3f start = Vec3f::Zero();
  Vec3f light_point = Vec3f::Zero();
};

bool belong_together(const Sample& a, const Sample& b) {
  return a.surface == b.surface &&
         (a.surface < 0 || std::abs(a.depth_mm - b.depth_mm) < kSameDepth * std::min(a.depth_mm, b.depth_mm));
}

}  // namespace

struct Renderer::Scene {
  SimulatedCamera camera;
  SimulatedLook look;
  Vec3f light_mm;
  float light_power;
  RayScene rays;
  std::vector<DrawnSurface> surfaces;

  Vec3f camera_mm(int side) const { return {side == 0 ? 0.0f : static_cast<float>(camera.baseline_mm), 0, 0}; }

  // Along the optical axis 1, so that a ray's length is its depth.
  Vec3f ray_direction(float x_px, float y_px) const {
    const auto focal = static_cast<float>(camera.focal_px);
    return {(x_px - 0.5f * static_cast<float>(camera.width - 1)) / focal,
            (y_px - 0.5f * static_cast<float>(camera.height - 1)) / focal, 1};
  }

  // The light is a disc that faces forward; `bits` pick the point of it.
  Vec3f point_of_light(uint32_t bits) const {
    const float r = static_cast<float>(look.light.radius_mm) * std::sqrt(unit_from_bits(bits));
    const float angle = 2 * std::numbers::pi_v<float> * unit_from_bits(bits * 0x9E3779B9u);
    return light_mm + Vec3f(r * std::cos(angle), r * std::sin(angle), 0);
  }

  // Light that leaves a point towards the camera, apart from what stands between it and the light.
  Lit light_up(const RayHit& hit, const BakedTexture::Spot& spot, const Vec3f& point, const Vec3f& to_camera,
               uint32_t bits) const {
    const DrawnSurface& surface = surfaces[static_cast<size_t>(hit.surface)];
    const Triangle& triangle = surface.triangles[static_cast<size_t>(hit.triangle)];
    const auto normal_at = [&](size_t k) -> const Vec3f& { return surface.normals[static_cast<size_t>(triangle[k])]; };
    Vec3f smooth = (1 - hit.u - hit.v) * normal_at(0) + hit.u * normal_at(1) + hit.v * normal_at(2);
    smooth.normalize();
    if (smooth.dot(to_camera) < 0) smooth = -smooth;
    const Texel texel = spot.texel();
    const Vec3f normal = (smooth - texel.slope + smooth * smooth.dot(texel.slope)).normalized();

    Lit lit;
    lit.light_point = point_of_light(bits);
    lit.start = point + kShadowStart_mm * smooth;
    const Vec3f to_light_mm = lit.light_point - point;
    const float distance = to_light_mm.norm();
    const Vec3f to_light = to_light_mm / distance;
    const auto reference = static_cast<float>(look.light.reference_mm);
    const float arriving = light_power * reference * reference / (distance * distance);
    lit.around = kAmbient * arriving * texel.albedo;
    const float cosine = normal.dot(to_light);
    if (cosine <= 0 || smooth.dot(to_light) <= 0) return lit;
    lit.faces_light = true;
    lit.direct = arriving * cosine * texel.albedo;
    lit.direct.array() += arriving * specular(normal, to_light, to_camera, surface.alpha, surface.reflectance);
    return lit;
  }

  void sample(int side, const Bundle<float>& x_px, const Bundle<float>& y_px, uint32_t frame,
              Bundle<Sample>& samples) const {
    const Vec3f origin = camera_mm(side);
    Bundle<Vec3f> directions, from, to;
    for (size_t i = 0; i < kBundle; ++i) directions[i] = ray_direction(x_px[i], y_px[i]);
    Bundle<RayHit> hits;
    rays.first_hits(origin, directions, hits);
    // All spots before the first is read: the texture is larger than the caches.
    Bundle<BakedTexture::Spot> spots;
    for (size_t i = 0; i < kBundle; ++i)
      if (hits[i].surface >= 0)
        spots[i] = surfaces[static_cast<size_t>(hits[i].surface)].texture.spot(hits[i].triangle, hits[i].u, hits[i].v);
    Bundle<Lit> lit;
    Bundle<bool> faces_light;
    for (size_t i = 0; i < kBundle; ++i) {
      if (hits[i].surface >= 0) {
        const auto eighths = [](float px) { return static_cast<uint32_t>(static_cast<int>(std::lround(8 * px))); };
        const uint32_t bits = hash_bits(eighths(x_px[i]), eighths(y_px[i]), 2 * frame + static_cast<uint32_t>(side),
                                        static_cast<uint32_t>(look.seed));
        lit[i] =
            light_up(hits[i], spots[i], origin + hits[i].length * directions[i], -directions[i].normalized(), bits);
      }
      from[i] = lit[i].start;
      to[i] = lit[i].light_point;
      faces_light[i] = lit[i].faces_light;
    }
    const Bundle<bool> blocked = rays.blocked(faces_light, from, to);
    for (size_t i = 0; i < kBundle; ++i) {
      samples[i].surface = hits[i].surface;
      samples[i].depth_mm = hits[i].surface < 0 ? std::numeric_limits<float>::infinity() : hits[i].length;
      samples[i].colour = lit[i].around;
      if (!blocked[i]) samples[i].colour += lit[i].direct;
    }
  }

  // Samples at x = first_x, first_x + 1, ...
  void sample_row(int side, float first_x, float y, uint32_t frame, Sample* samples, int count) const {
    Bundle<float> x_px, y_px;
    Bundle<Sample> bundle;
    y_px.fill(y);
    for (int start = 0; start < count; start += kBundle) {
      for (int i = 0; i < kBundle; ++i) x_px[static_cast<size_t>(i)] = first_x + static_cast<float>(start + i);
      sample(side, x_px, y_px, frame, bundle);
      std::copy_n(bundle.begin(), std::min(kBundle, count - start), samples + start);
    }
  }

  // Middle and corners of a pixel belong to one smooth surface: their mean. Where surfaces meet: many samples.
  Vec3f pixel_colour(int side, int x, int y, uint32_t frame, const Sample& middle,
                     const std::array<const Sample*, 4>& corners) const {
    bool smooth = true;
    for (const Sample* corner : corners) smooth = smooth && belong_together(middle, *corner);
    Vec3f sum = Vec3f::Zero();
    if (smooth) {
      for (const Sample* corner : corners) sum += 0.125f * corner->colour;
      return sum + 0.5f * middle.colour;
    }
    Bundle<float> x_px, y_px;
    Bundle<Sample> samples;
    for (int i = 0; i < kBundle; ++i) {
      x_px[static_cast<size_t>(i)] = static_cast<float>(x) + (static_cast<float>(i % 4) + 0.5f) / 4 - 0.5f;
      y_px[static_cast<size_t>(i)] = static_cast<float>(y) + (static_cast<float>(i / 4) + 0.5f) / 4 - 0.5f;
    }
    sample(side, x_px, y_px, frame, samples);
    for (const Sample& part : samples) sum += part.colour.cwiseMin(kBrightest) / kBundle;
    return sum;
  }

  cv::Mat draw(int side, uint32_t frame, cv::Mat& depth_mm) const {
    const int width = camera.width, height = camera.height;
    const auto corner_columns = static_cast<size_t>(width) + 1;
    std::vector<Sample> corners(corner_columns * (static_cast<size_t>(height) + 1));
    tbb::parallel_for(0, height + 1, [&](int y) {
      sample_row(side, -0.5f, static_cast<float>(y) - 0.5f, frame, &corners[static_cast<size_t>(y) * corner_columns],
                 width + 1);
    });
    cv::Mat linear(height, width, CV_32FC3);
    depth_mm.create(height, width, CV_32F);
    tbb::parallel_for(0, height, [&](int y) {
      std::vector<Sample> middles(static_cast<size_t>(width));
      sample_row(side, 0, static_cast<float>(y), frame, middles.data(), width);
      for (int x = 0; x < width; ++x) {
        const Sample* corner = &corners[static_cast<size_t>(y) * corner_columns + static_cast<size_t>(x)];
        const Vec3f rgb = pixel_colour(side, x, y, frame, middles[static_cast<size_t>(x)],
                                       {corner, corner + 1, corner + corner_columns, corner + corner_columns + 1});
        linear.at<cv::Vec3f>(y, x) = {rgb.z(), rgb.y(), rgb.x()};
        depth_mm.at<float>(y, x) = middles[static_cast<size_t>(x)].depth_mm;
      }
    });
    return linear;
  }
};

Renderer::Renderer(const SimulatedCamera& camera, const SimulatedLook& look) : scene_(std::make_unique<Scene>()) {
  scene_->camera = camera;
  scene_->look = look;
  scene_->light_mm = (Vec3(camera.baseline_mm / 2, 0, 0) + look.light.position_mm).cast<float>();
  scene_->light_power = static_cast<float>(look.exposure);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

int Renderer::add(const Surface& rest, const SurfaceLook& look) {
  const auto alpha = static_cast<float>(look.roughness * look.roughness);
  scene_->surfaces.push_back({rest.triangles,
                              {},
                              BakedTexture(rest, look.texture, look.texels_per_mm),
                              alpha,
                              static_cast<float>(look.reflectance)});
  const int number = scene_->rays.add(rest.triangles, rest.vertices_mm.size());
  move(number, rest.vertices_mm);
  return number;
}

void Renderer::move(int surface, const std::vector<Vec3>& vertices_mm) {
  DrawnSurface& drawn = scene_->surfaces.at(static_cast<size_t>(surface));
  drawn.normals.clear();
  for (const Vec3& normal : vertex_normals(vertices_mm, drawn.triangles)) drawn.normals.push_back(normal.cast<float>());
  scene_->rays.place(surface, vertices_mm);
}

StereoLight Renderer::light(int index, double time_s) {
  scene_->rays.commit();
  const auto number = static_cast<uint32_t>(index);
  StereoLight light;
  cv::Mat right_depth_mm;
  light.left = scene_->draw(0, number, light.left_depth_mm);
  light.right = scene_->draw(1, number, right_depth_mm);
  const auto camera_mm = [this](int side) -> Vec3 { return scene_->camera_mm(side).cast<double>(); };
  add_smoke(light.left, light.left_depth_mm, scene_->camera, scene_->look, camera_mm(0), time_s);
  add_smoke(light.right, right_depth_mm, scene_->camera, scene_->look, camera_mm(1), time_s);
  return light;
}

StereoFrame Renderer::render(int index) {
  return recorded(light(index, index / scene_->camera.fps), scene_->camera, scene_->look, index);
}

cv::Mat Renderer::visible_mask(int surface, int side) {
  scene_->rays.commit();
  cv::Mat mask(scene_->camera.height, scene_->camera.width, CV_8U, cv::Scalar(0));
  tbb::parallel_for(0, mask.rows, [&](int y) {
    for (int x = 0; x < mask.cols; ++x) {
      const Vec3f direction = scene_->ray_direction(static_cast<float>(x), static_cast<float>(y));
      if (scene_->rays.first_hit(scene_->camera_mm(side), direction).surface == surface) mask.at<uchar>(y, x) = 255;
    }
  });
  return mask;
}

}  // namespace palpate
