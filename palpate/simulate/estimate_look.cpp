#include "palpate/simulate/estimate_look.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/simulate/ray_scene.h"
#include "palpate/simulate/sensor.h"
#include "palpate/simulate/shading.h"

namespace palpate {
namespace {

using Vec3f = Eigen::Vector3f;

const int kMinPixels = 500;
const int kMaxSamples = 40000;
// Deviation of the light's place from the camera that is expected: it shines from the tip of the scope. How far in
// front it stands and how bright tissue is look nearly the same.
const Eigen::Array3d kLightNear_mm(15, 15, 2);
const double kOutlier = 0.35;           // of log albedo
const float kMinCosine = 0.15f;         // of light that grazes nothing is learned
const float kSaturated = 2.0f;          // of light; such a pixel says only that it is bright
const float kHighlightFraction = 0.3f;  // of a pixel's light, from where on it is filled in

const float kDarkest = 0.003f, kBrightest = 0.9f;  // albedo

// A pixel that shows the surface.
struct Seen {
  int x, y;
  Vec3f point_mm, normal, to_camera;
  Vec3f bgr;  // light
};

std::vector<Seen> look_at(const cv::Mat& bgr, const Camera& camera, const Surface& surface) {
  RayScene rays;
  rays.add(surface.triangles, surface.vertices_mm.size());
  rays.place(0, surface.vertices_mm);
  rays.commit();
  const std::vector<Vec3> normals = vertex_normals(surface.vertices_mm, surface.triangles);
  std::vector<std::vector<Seen>> rows(static_cast<size_t>(bgr.rows));
  tbb::parallel_for(0, bgr.rows, [&](int y) {
    std::vector<cv::Point2d> pixels, places;
    for (int x = 0; x < bgr.cols; ++x) pixels.emplace_back(x, y);
    cv::undistortPoints(pixels, places, camera.K, camera.distortion);
    for (int x = 0; x < bgr.cols; ++x) {
      const cv::Point2d& place = places[static_cast<size_t>(x)];
      const Vec3f direction(static_cast<float>(place.x), static_cast<float>(place.y), 1);
      const RayHit hit = rays.first_hit(Vec3f::Zero(), direction);
      if (hit.surface < 0) continue;
      const Triangle& t = surface.triangles[static_cast<size_t>(hit.triangle)];
      const auto normal_at = [&](size_t k) -> Vec3f { return normals[static_cast<size_t>(t[k])].cast<float>(); };
      Seen seen{x, y, hit.length * direction, {}, -direction.normalized(), {}};
      seen.normal = ((1 - hit.u - hit.v) * normal_at(0) + hit.u * normal_at(1) + hit.v * normal_at(2)).normalized();
      if (seen.normal.dot(seen.to_camera) < 0) seen.normal = -seen.normal;
      const auto& level = bgr.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) seen.bgr[c] = light_from_level(level[c]);
      rows[static_cast<size_t>(y)].push_back(seen);
    }
  });
  std::vector<Seen> all;
  for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
  return all;
}

// Cosine over squared distance, relative to the reference distance.
float shading(const Seen& seen, const Vec3f& light_mm, float reference_mm, float& arriving) {
  const Vec3f to_light = light_mm - seen.point_mm;
  const float distance = to_light.norm();
  arriving = reference_mm * reference_mm / (distance * distance);
  return arriving * seen.normal.dot(to_light) / distance;
}

// log(red / shading) of a sample; red holds most of tissue's light and the least of highlights.
double log_albedo(const Seen& seen, const Vec3& light_mm, double reference_mm) {
  float arriving = 0;
  const float shade = shading(seen, light_mm.cast<float>(), static_cast<float>(reference_mm), arriving);
  return std::log(std::max(1e-4f, seen.bgr[2])) - std::log(std::max(1e-3f, shade));
}

// Gauss-Newton with Cauchy weights on log albedo = constant; the light is expected near the camera.
Vec3 fit_light(const std::vector<Seen>& samples, double reference_mm, double& scatter) {
  Vec3 light_mm = Vec3::Zero();
  double level = 0;
  {
    std::vector<double> first;
    for (const Seen& seen : samples) first.push_back(log_albedo(seen, light_mm, reference_mm));
    level = median_of(first);
  }
  const double step_mm = 0.5, count = static_cast<double>(samples.size());
  for (int iteration = 0; iteration < 40; ++iteration) {
    Eigen::Matrix4d normal_matrix = Eigen::Matrix4d::Zero();
    Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
    double sum = 0, weights = 0;
    for (const Seen& seen : samples) {
      const double r = log_albedo(seen, light_mm, reference_mm) - level;
      Eigen::Vector4d slope(0, 0, 0, -1);
      for (int k = 0; k < 3; ++k)
        slope[k] = (log_albedo(seen, light_mm + step_mm * Vec3::Unit(k), reference_mm) -
                    log_albedo(seen, light_mm - step_mm * Vec3::Unit(k), reference_mm)) /
                   (2 * step_mm);
      const double weight = 1 / (1 + r * r / (kOutlier * kOutlier));
      normal_matrix += weight * slope * slope.transpose();
      gradient += weight * r * slope;
      sum += weight * r * r;
      weights += weight;
    }
    scatter = std::sqrt(sum / weights);
    // Neighbouring pixels share their albedo: only so many of them speak for themselves.
    const Eigen::Array3d prior = 1e-3 * count * scatter * scatter / kLightNear_mm.square();
    normal_matrix.topLeftCorner<3, 3>().diagonal().array() += prior;
    gradient.head<3>().array() += prior * light_mm.array();
    const Eigen::Vector4d step = normal_matrix.ldlt().solve(gradient);
    light_mm -= step.head<3>() * std::min(1.0, 20 / step.head<3>().norm());
    level -= step[3];
    if (step.head<3>().norm() < 1e-3) break;
  }
  return light_mm;
}

// What is grey on top of the tissue's own colour, given the usual blue over red of tissue.
float grey_part(const Seen& seen, float blue_over_red) {
  return std::max(0.0f, (seen.bgr[0] - blue_over_red * seen.bgr[2]) / (1 - blue_over_red));
}

float lobe(const Seen& seen, const Vec3f& light_mm, float roughness) {
  return specular(seen.normal, (light_mm - seen.point_mm).normalized(), seen.to_camera, roughness * roughness, 1);
}

// The lobe whose multiple is nearest to the grey part of the samples.
void fit_gloss(const std::vector<Seen>& samples, float power, float reference_mm, float blue_over_red,
               EstimatedLook& look) {
  const Vec3f light_mm = look.light_mm.cast<float>();
  double min = std::numeric_limits<double>::infinity();
  for (double roughness = 0.15; roughness < 0.9; roughness += 0.01) {
    double lobe2 = 0, lobe_grey = 0, grey2 = 0;
    for (const Seen& seen : samples) {
      if (seen.bgr.maxCoeff() > kSaturated) continue;
      float arriving = 0;
      shading(seen, light_mm, reference_mm, arriving);
      const double l = power * arriving * lobe(seen, light_mm, static_cast<float>(roughness));
      const double grey = grey_part(seen, blue_over_red);
      lobe2 += l * l;
      lobe_grey += l * grey;
      grey2 += grey * grey;
    }
    const double rest = grey2 - lobe_grey * lobe_grey / std::max(1e-12, lobe2);
    if (rest >= min) continue;
    min = rest;
    look.roughness = roughness;
    look.reflectance = std::clamp(lobe_grey / std::max(1e-12, lobe2), 0.0, 1.0);
  }
}

// Fills where `known` is 0 with the mean of what is known around, near before far.
void fill(cv::Mat& image, cv::Mat known) {
  for (double reach_px = 3; reach_px < 4 * std::max(image.cols, image.rows); reach_px *= 3) {
    if (cv::countNonZero(known) == static_cast<int>(known.total())) return;
    cv::Mat weight, weights, sum, weighted = image.clone();
    known.convertTo(weight, CV_32F, 1 / 255.0);
    weighted.setTo(cv::Scalar::all(0), known == 0);
    const int size = 2 * static_cast<int>(reach_px) + 1;
    cv::blur(weighted, sum, {size, size});
    cv::blur(weight, weights, {size, size});
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        if (known.at<uchar>(y, x) == 0 && weights.at<float>(y, x) > 0.02f) {
          image.at<cv::Vec3f>(y, x) = sum.at<cv::Vec3f>(y, x) / weights.at<float>(y, x);
          known.at<uchar>(y, x) = 255;
        }
  }
}

}  // namespace

EstimatedLook estimate_look(const cv::Mat& left_bgr, const Camera& left_camera, const Surface& surface,
                            const SimulatedLook& look) {
  const std::vector<Seen> all = look_at(left_bgr, left_camera, surface);
  if (all.size() < kMinPixels)
    throw BadInput(
        "simulate.look.texture_from: the surface covers too little of the image; is it in mm, in the left "
        "camera frame, and of this image?");
  std::vector<Seen> samples;
  for (size_t i = 0; i < all.size(); i += std::max<size_t>(1, all.size() / kMaxSamples))
    if (all[i].normal.dot(all[i].to_camera) > 2 * kMinCosine) samples.push_back(all[i]);

  EstimatedLook found;
  found.light_mm = fit_light(samples, look.light.reference_mm, found.shading_scatter);
  const Vec3f light_mm = found.light_mm.cast<float>();
  const auto power = static_cast<float>(look.exposure), reference_mm = static_cast<float>(look.light.reference_mm);
  std::vector<float> ratios, depths;
  for (const Seen& seen : samples) {
    ratios.push_back(seen.bgr[0] / std::max(1e-3f, seen.bgr[2]));
    depths.push_back(seen.point_mm.z());
  }
  const float blue_over_red = std::min(0.95f, median_of(ratios));
  fit_gloss(samples, power, reference_mm, blue_over_red, found);

  found.albedo = cv::Mat::zeros(left_bgr.size(), CV_32FC3);
  found.seen = cv::Mat::zeros(left_bgr.size(), CV_8U);
  cv::Mat known = cv::Mat::zeros(left_bgr.size(), CV_8U);
  std::vector<float> brightest;
  for (const Seen& seen : all) {
    found.seen.at<uchar>(seen.y, seen.x) = 255;
    float arriving = 0;
    const float shade = shading(seen, light_mm, reference_mm, arriving);
    const float gloss = static_cast<float>(found.reflectance) * power * arriving *
                        lobe(seen, light_mm, static_cast<float>(found.roughness));
    const float grey = grey_part(seen, blue_over_red);
    if (shade < kMinCosine * arriving || seen.bgr.maxCoeff() > kSaturated ||
        std::min(grey, 2 * gloss) > kHighlightFraction * seen.bgr.maxCoeff())
      continue;
    const Vec3f albedo = (seen.bgr.array() - std::min(grey, gloss)).matrix() / (power * shade);
    for (int c = 0; c < 3; ++c) found.albedo.at<cv::Vec3f>(seen.y, seen.x)[c] = std::max(kDarkest, albedo[c]);
    brightest.push_back(albedo.maxCoeff());
    known.at<uchar>(seen.y, seen.x) = 255;
  }
  if (brightest.empty()) throw BadInput("simulate.look.texture_from: the image shows nothing but highlights");
  const auto high = brightest.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(brightest.size()));
  std::nth_element(brightest.begin(), high, brightest.end());
  if (*high > kBrightest) found.albedo *= kBrightest / *high;
  fill(found.albedo, known);
  found.mm_per_px = median_of(depths) / left_camera.K(0, 0);
  return found;
}

}  // namespace palpate
