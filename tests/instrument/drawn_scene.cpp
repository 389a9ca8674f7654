#include "tests/instrument/drawn_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <tuple>

namespace palpate::test {

namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr double kFocal = 500, kCenterX = 319.5, kCenterY = 179.5, kBaseline = 5, kTissueDepth = 90;

struct Hit {
  bool hit = false;
  double missed_by_mm = 1e9;
  double along_mm = 0;  ///< back from the tip
  double angle = 0;
  double facing = 0;  ///< cosine between normal and viewing ray
  double distance_mm = 1e9;
};

double radius_at(const DrawnInstrument& i, double back) {
  const double fraction = std::clamp(back / i.jaw_mm, 0.0, 1.0);
  return i.tip_radius_mm + fraction * (i.radius_mm - i.tip_radius_mm);
}

/// Ray from (camera, 0, 0) through a pixel, by stepping with a bound on the distance to the surface.
Hit cast(const DrawnInstrument& instrument, double camera_mm, double x, double y) {
  const Vec3 origin(camera_mm, 0, 0);
  const Vec3 ray = Vec3((x - kCenterX) / kFocal, (y - kCenterY) / kFocal, 1).normalized();
  // The ball ends at the tip, so that the tip is the far end of the drawn body.
  const Vec3 end = instrument.tip_mm - instrument.tip_radius_mm * instrument.direction;
  // Most rays pass even the endless shaft at a distance.
  const Vec3 across = ray.cross(instrument.direction).normalized();
  const double passed_by_mm = std::abs((end - origin).dot(across)) - instrument.radius_mm;
  if (passed_by_mm > 1) {
    Hit miss;
    miss.missed_by_mm = passed_by_mm;
    return miss;
  }
  double t = 20, nearest = 1e9;
  for (int step = 0; step < 80 && t < 140; ++step) {
    const Vec3 p = origin + t * ray;
    const double back = std::max(0.0, (end - p).dot(instrument.direction));
    const Vec3 foot = end - back * instrument.direction;
    const double distance = (p - foot).norm() - radius_at(instrument, back);
    nearest = std::min(nearest, distance);
    if (distance < 0.005) {
      Hit hit;
      hit.hit = true;
      hit.along_mm = back;
      hit.distance_mm = t;
      const Vec3 normal = (p - foot).normalized();
      const Vec3 side = instrument.direction.cross(Vec3::UnitZ()).normalized();
      hit.angle = std::atan2(normal.dot(side), normal.dot(side.cross(instrument.direction)));
      hit.facing = std::max(0.0, -normal.dot(ray));
      return hit;
    }
    t += 0.9 * distance;
  }
  Hit miss;
  miss.missed_by_mm = nearest;
  return miss;
}

/// The nearest hit; how far all were missed when there is none.
Hit cast(const std::vector<DrawnInstrument>& instruments, double camera_mm, double x, double y) {
  Hit nearest;
  for (const DrawnInstrument& instrument : instruments) {
    const Hit hit = cast(instrument, camera_mm, x, y);
    if (hit.hit ? hit.distance_mm < nearest.distance_mm : !nearest.hit && hit.missed_by_mm < nearest.missed_by_mm)
      nearest = hit;
  }
  return nearest;
}

double metal_grey(const Hit& hit) {
  const double pattern =
      18 * std::sin(1.3 * hit.along_mm) * std::cos(2 * hit.angle) + 14 * std::sin(0.55 * hit.along_mm);
  const double ring = std::fmod(hit.along_mm, 9) < 0.8 ? -40 : 0;
  return (70 + 75 * hit.facing) + (pattern + ring) * hit.facing;
}

cv::Vec3d tissue_bgr(double x_mm, double y_mm) {
  const double wave = std::sin(0.9 * x_mm + 1.7 * std::sin(0.31 * y_mm)) +
                      std::sin(0.8 * y_mm + 1.3 * std::cos(0.4 * x_mm)) + 0.6 * std::sin(2.1 * x_mm - 1.4 * y_mm);
  const double light = 1 + 0.12 * wave;
  return {48 * light, 52 * light, 135 * light};
}

cv::Mat draw_camera(const DrawnScene& scene, const std::vector<DrawnInstrument>& instruments, double camera_mm,
                    int index) {
  cv::Mat image(kHeight, kWidth, CV_8UC3);
  cv::RNG noise(scene.noise_seed * 1000 + static_cast<unsigned>(index) * 2 + (camera_mm > 0));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      cv::Vec3d sum(0, 0, 0);
      const Hit centre = cast(instruments, camera_mm, x, y);
      const bool clear = !centre.hit && centre.missed_by_mm > 0.4;
      for (int sub = 0; sub < (clear ? 1 : 4); ++sub) {
        const double px = x + (clear ? 0 : (sub % 2) * 0.5 - 0.25), py = y + (clear ? 0 : (sub / 2) * 0.5 - 0.25);
        const Hit hit = clear ? Hit() : cast(instruments, camera_mm, px, py);
        if (hit.hit)
          sum += cv::Vec3d::all(metal_grey(hit));
        else
          sum +=
              tissue_bgr((px - kCenterX) * kTissueDepth / kFocal + camera_mm, (py - kCenterY) * kTissueDepth / kFocal);
      }
      for (int c = 0; c < 3; ++c)
        image.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<uchar>(sum[c] / (clear ? 1 : 4) + noise.gaussian(1.5));
    }
  if (scene.highlights) {
    const double shift = scene.highlight_shift_px - kFocal * camera_mm / kTissueDepth;
    for (const auto& [x, y, r] : {std::tuple{150, 120, 26}, {260, 250, 14}, {480, 90, 18}, {300, 60, 9}})
      cv::circle(image, cv::Point2d(x + shift, y), r, cv::Scalar(250, 250, 252), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

}  // namespace

Rectification drawn_rectification() {
  Rectification rectification;
  rectification.size = {kWidth, kHeight};
  rectification.focal_px = kFocal;
  rectification.principal_x_px = kCenterX;
  rectification.principal_y_px = kCenterY;
  rectification.baseline_mm = kBaseline;
  rectification.identity = true;
  return rectification;
}

RectifiedPair draw_pair_of(const std::vector<DrawnInstrument>& instruments, const DrawnScene& scene, int index) {
  RectifiedPair pair;
  pair.index = index;
  pair.time_s = 0.04 * index;
  pair.left = draw_camera(scene, instruments, 0, index);
  pair.right = draw_camera(scene, instruments, kBaseline, index);
  return pair;
}

RectifiedPair draw_pair(const DrawnScene& scene, const DrawnInstrument& instrument, int index) {
  return draw_pair_of(scene.instrument ? std::vector{instrument} : std::vector<DrawnInstrument>{}, scene, index);
}

cv::Mat drawn_mask(const DrawnInstrument& instrument, double camera_mm) {
  cv::Mat mask(kHeight, kWidth, CV_8U);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) mask.at<uchar>(y, x) = cast(instrument, camera_mm, x, y).hit ? 255 : 0;
  return mask;
}

}  // namespace palpate::test
