#include "palpate/simulate/stage.h"

#include <algorithm>

namespace palpate {
namespace {

const double kWallBehind_mm = 14;

// The back of the cavity: a shallow bowl behind the organ that fills both images.
Surface make_wall(const SimulatedCamera& camera, const Surface& organ) {
  double deepest = 0;
  for (const Vec3& vertex : organ.vertices_mm) deepest = std::max(deepest, vertex.z());
  const double depth = deepest + kWallBehind_mm;
  const double half_x = 0.6 * depth * camera.width / camera.focal_px + camera.baseline_mm;
  const double half_y = 0.6 * depth * camera.height / camera.focal_px;
  const int columns = 100, rows = 60;
  Surface wall;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) {
      const double a = 2.0 * i / columns - 1, b = 2.0 * j / rows - 1;
      wall.vertices_mm.emplace_back(half_x * a, half_y * b, depth * (1 - 0.10 * (a * a + b * b)));
    }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int corner = j * (columns + 1) + i, below = corner + columns + 1;
      wall.triangles.push_back({corner, below, corner + 1});
      wall.triangles.push_back({corner + 1, below, below + 1});
    }
  return wall;
}

std::vector<Vec3> moved_by(std::vector<Vec3> points_mm, const Vec3& by_mm) {
  for (Vec3& point : points_mm) point += by_mm;
  return points_mm;
}

}  // namespace

Stage::Stage(const SimulateOptions& options, const Surface& organ, const TruthBody& truth,
             const InstrumentPlace& first_place)
    : options_(options),
      organ_(organ),
      wall_(make_wall(options.camera, organ)),
      shown_organ_(organ),
      skin_(attach_skin(organ.vertices_mm, truth.mesh.nodes_mm, truth.boundary)),
      renderer_(options.camera, options.look) {
  const auto texels_per_mm = [&](double depth) { return std::min(8.0, options.camera.focal_px / depth); };
  const SimulatedLook& look = options.look;
  organ_number_ = renderer_.add(organ_, {bloody(tissue_texture(look), look.blood, look.seed),
                                         texels_per_mm(organ_.vertices_mm[0].z()), look.roughness, 0.04});
  wall_number_ = renderer_.add(wall_, {wall_texture(look.seed), texels_per_mm(wall_.vertices_mm[0].z()), 0.6, 0.03});
  instrument_number_ =
      renderer_.add(make_instrument(options.instrument, first_place), {steel_texture(), 1, 0.55, 0.35});
}

void Stage::show(const Moment& moment) {
  shown_organ_.vertices_mm = moved_by(
      moment.u.size() == 0 ? organ_.vertices_mm : moved_skin(skin_, organ_.vertices_mm, moment.u), moment.breath_mm);
  renderer_.move(organ_number_, shown_organ_.vertices_mm);
  if (options_.breathing.motion_mm != Vec3::Zero())
    renderer_.move(wall_number_, moved_by(wall_.vertices_mm, moment.breath_mm));
  renderer_.move(instrument_number_, make_instrument(options_.instrument, moment.place).vertices_mm);
}

}  // namespace palpate
