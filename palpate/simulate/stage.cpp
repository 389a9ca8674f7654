#include "palpate/simulate/stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/simulate/estimate_look.h"
#include "palpate/simulate/instrument_look.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/scene_motion.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {
namespace {

const double kWallBehind_mm = 14;
const int kGauzeSubdivisions = 4;
const double kGauzeBefore_mm = 1;        // nearer to the camera than the tip
const Vec3 kOutOfSight_mm(0, 0, -1000);  // behind the cameras

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

// A part of the picture that shows the surface nearly everywhere, so that little is filled in.
cv::Rect well_seen(const cv::Mat& seen) {
  cv::Rect part = cv::boundingRect(seen);
  while (part.width > 64 && part.height > 64 && cv::countNonZero(seen(part)) < 0.97 * part.area()) {
    const int dx = std::max(1, part.width / 40), dy = std::max(1, part.height / 40);
    part = {part.x + dx, part.y + dy, part.width - 2 * dx, part.height - 2 * dy};
  }
  return part;
}

// The texture of the organ; where a picture is given, its light and gloss become those of `options`.
Texture take_look(SimulateOptions& options) {
  SimulatedLook& look = options.look;
  const TextureSource& source = look.texture_from;
  if (source.image.empty()) return tissue_texture(look);
  const cv::Mat image = cv::imread(source.image.string(), cv::IMREAD_COLOR);
  if (image.empty())
    throw BadInput(
        fmt::format("simulate.look.texture_from.image: {} is not an image that can be read", source.image.string()));
  const StereoRig rig = read_rig(source.calibration);
  check_rig_fits(rig, image.size());
  const EstimatedLook found = estimate_look(image, rig.left, read_polygon_soup(source.surface), look);
  look.light.position_mm = found.light_mm - Vec3(options.camera.baseline_mm / 2, 0, 0);
  look.roughness = found.roughness;
  look.reflectance = found.reflectance;
  return image_texture(found.albedo(well_seen(found.seen)).clone(), found.mm_per_px, look.seed);
}

std::vector<Vec3> moved_by(std::vector<Vec3> points_mm, const Vec3& by_mm) {
  for (Vec3& point : points_mm) point += by_mm;
  return points_mm;
}

// A ball around the origin.
Surface make_gauze(double radius_mm) {
  Surface gauze = make_sphere(kGauzeSubdivisions);
  for (Vec3& vertex : gauze.vertices_mm) vertex *= radius_mm;
  return gauze;
}

}  // namespace

Stage::Stage(const SimulateOptions& options, const Surface& organ, const TruthBody& truth, const Moment& first)
    : options_(options),
      tissue_(take_look(options_)),
      organ_(organ),
      wall_(make_wall(options.camera, organ)),
      gauze_(make_gauze(options.obscured.radius_mm)),
      shown_organ_(organ),
      skin_(attach_skin(organ.vertices_mm, truth.mesh.nodes_mm, truth.boundary)),
      renderer_(options_.camera, options_.look) {
  const auto texels_per_mm = [&](double depth) { return std::min(8.0, options.camera.focal_px / depth); };
  const SimulatedLook& look = options_.look;
  organ_number_ = renderer_.add(organ_, {bloody(tissue_, look.blood, look.seed),
                                         texels_per_mm(organ_.vertices_mm[0].z()), look.roughness, look.reflectance});
  wall_number_ = renderer_.add(wall_, {wall_texture(look.seed), texels_per_mm(wall_.vertices_mm[0].z()), 0.6, 0.03});
  instrument_number_ = renderer_.add(make_instrument(options.instrument, first.place),
                                     instrument_look(options.instrument, first.place, look.seed));
  if (options.second.present)
    second_instrument_number_ =
        renderer_.add(make_instrument(options.second.instrument, first.second_place),
                      instrument_look(options.second.instrument, first.second_place, look.seed + 1));
  if (options.obscured.to_s > options.obscured.from_s) {
    gauze_number_ = renderer_.add(gauze_, {gauze_texture(), texels_per_mm(first.place.tip_mm.z()), 0.8, 0.02});
    renderer_.move(gauze_number_, moved_by(gauze_.vertices_mm, kOutOfSight_mm));
  }
}

void Stage::show(const Moment& moment) {
  shown_organ_.vertices_mm = moved_by(
      moment.u.size() == 0 ? organ_.vertices_mm : moved_skin(skin_, organ_.vertices_mm, moment.u), moment.scene_mm);
  renderer_.move(organ_number_, shown_organ_.vertices_mm);
  if (moment.scene_mm != shown_scene_mm_) renderer_.move(wall_number_, moved_by(wall_.vertices_mm, moment.scene_mm));
  shown_scene_mm_ = moment.scene_mm;
  renderer_.move(instrument_number_, make_instrument(options_.instrument, moment.place).vertices_mm);
  if (options_.second.present)
    renderer_.move(second_instrument_number_,
                   make_instrument(options_.second.instrument, moment.second_place).vertices_mm);
  if (gauze_number_ >= 0) {
    const Vec3& tip_mm = moment.place.tip_mm;
    const Vec3 before_tip_mm = tip_mm - (options_.obscured.radius_mm + kGauzeBefore_mm) * tip_mm.normalized();
    const bool here = is_obscured(options_.obscured, moment.truth.time_s);
    renderer_.move(gauze_number_, moved_by(gauze_.vertices_mm, here ? before_tip_mm : kOutOfSight_mm));
  }
}

}  // namespace palpate
