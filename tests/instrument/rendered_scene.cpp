#include "tests/instrument/rendered_scene.h"

#include <algorithm>
#include <cmath>

#include "palpate/simulate/noise.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/texture.h"

namespace palpate::test {

namespace {

using Colour = Eigen::Vector3f;

constexpr int kBlurSteps = 5;
const Vec3 kAway(0, 0, -500);  // behind the cameras

SimulatedCamera camera_of(int height) {
  SimulatedCamera camera;
  camera.height = height;
  camera.width = height * 16 / 9;
  camera.focal_px = 700.0 * height / 540;
  return camera;
}

float step(float from, float to, float x) {
  return std::clamp((x - from) / (to - from), 0.0f, 1.0f);
}

/// The procedural tissue with its colours exchanged.
Texture tissue_of(Tissue kind, const SimulatedLook& look) {
  const Texture red = tissue_texture(look);
  if (kind == Tissue::red) return red;
  return [kind, red](const Vec3& rest_mm, const Vec3& normal) {
    Texel texel = red(rest_mm, normal);
    const Eigen::Vector3f p = rest_mm.cast<float>();
    const float light = std::clamp(texel.albedo.x() / 0.5f, 0.3f, 1.5f);
    const float patch = fractal_noise(p / 14.0f, 77, 3).value;
    if (kind == Tissue::fat)
      texel.albedo = light * Colour(0.66f, 0.42f, 0.15f) + 0.2f * step(0.2f, 0.3f, patch) * texel.albedo;
    if (kind == Tissue::pale) texel.albedo = light * Colour(0.50f, 0.40f, 0.36f);
    if (kind == Tissue::brown) texel.albedo = light * Colour(0.20f, 0.095f, 0.06f);
    if (kind == Tissue::tendon) {  // white bands, as straight as an instrument, and white patches
      const float band = step(5.0f, 4.4f, std::abs(p.y() + 0.25f * p.x() + 14 + 0.6f * patch));
      const float fraction = std::max(band, step(0.28f, 0.33f, patch));
      texel.albedo += fraction * (light * Colour(0.62f, 0.59f, 0.55f) - texel.albedo);
    }
    return texel;
  };
}

Surface back_wall() {
  Surface wall;
  const double x = 160, y = 100, z = 150;
  wall.vertices_mm = {{-x, -y, z}, {x, -y, z}, {x, y, z}, {-x, y, z}};
  wall.triangles = {{0, 2, 1}, {0, 3, 2}};
  return wall;
}

SimulatedBody body() {
  SimulatedBody result;
  result.shape = "pear";
  result.size_mm = {130, 90, 50};
  result.center_mm = {-5, 4, 115};
  return result;
}

}  // namespace

RenderedScene::RenderedScene(Tissue tissue, const std::vector<SimulatedInstrument>& instruments, int height)
    : camera_(camera_of(height)),
      instruments_(instruments),
      organ_(make_organ(body(), 6000)),
      renderer_(camera_, look_) {
  organ_number_ = renderer_.add(organ_, {tissue_of(tissue, look_), 3, look_.roughness, look_.reflectance});
  renderer_.add(back_wall(), {wall_texture(look_.seed), 0.4, 0.6, 0.03});
  for (const SimulatedInstrument& instrument : instruments_) {
    const InstrumentPlace nowhere{kAway, Vec3::UnitZ(), 0.3};
    numbers_.push_back(renderer_.add(make_instrument(instrument, nowhere), instrument_look(instrument, nowhere, 3)));
  }
}

void RenderedScene::place(const std::vector<Vec3>& tips_mm) {
  for (size_t i = 0; i < instruments_.size(); ++i) {
    InstrumentPlace place{kAway, Vec3::UnitZ(), 0.3};
    if (i < tips_mm.size()) place = {tips_mm[i], (tips_mm[i] - instruments_[i].enters_from).normalized(), 0.3};
    renderer_.move(numbers_[i], make_instrument(instruments_[i], place).vertices_mm);
  }
}

RectifiedPair RenderedScene::draw(const std::vector<Vec3>& tips_mm, int index, const Vec3& tissue_mm,
                                  const Vec3& blur_mm) {
  std::vector<Vec3> moved = organ_.vertices_mm;
  for (Vec3& vertex : moved) vertex += tissue_mm;
  renderer_.move(organ_number_, moved);
  const int steps = blur_mm.isZero() ? 1 : kBlurSteps;
  StereoLight sum;
  for (int i = 0; i < steps; ++i) {
    std::vector<Vec3> tips = tips_mm;
    for (Vec3& tip : tips) tip += (steps == 1 ? 0.0 : static_cast<double>(i) / (steps - 1) - 0.5) * blur_mm;
    place(tips);
    const StereoLight light = renderer_.light(index, index / camera_.fps);
    sum.left = i == 0 ? light.left : sum.left + light.left;
    sum.right = i == 0 ? light.right : sum.right + light.right;
  }
  place(tips_mm);
  sum.left /= steps;
  sum.right /= steps;
  const StereoFrame frame = recorded(sum, camera_, look_, index);
  return {index, index / camera_.fps, frame.left, frame.right};
}

cv::Mat RenderedScene::truth_mask(size_t instrument, int camera) {
  return renderer_.visible_mask(numbers_.at(instrument), camera);
}

Rectification RenderedScene::rectification() const {
  Rectification result;
  result.size = {camera_.width, camera_.height};
  result.focal_px = camera_.focal_px;
  result.principal_x_px = 0.5 * (camera_.width - 1);
  result.principal_y_px = 0.5 * (camera_.height - 1);
  result.baseline_mm = camera_.baseline_mm;
  result.identity = true;
  return result;
}

}  // namespace palpate::test
