#include "palpate/simulate/organ_shape.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

#include "palpate/volume/body.h"

namespace palpate {
namespace {

// Every triangle into four; new vertices in the middle of the edges.
Surface subdivided(const Surface& coarse) {
  Surface fine;
  fine.vertices_mm = coarse.vertices_mm;
  std::map<std::pair<int, int>, int> middle_of;
  const auto middle = [&](int a, int b) {
    const auto [entry, is_new] =
        middle_of.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(fine.vertices_mm.size()));
    if (is_new)
      fine.vertices_mm.push_back(
          (coarse.vertices_mm[static_cast<size_t>(a)] + coarse.vertices_mm[static_cast<size_t>(b)]) / 2);
    return entry->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Triangle& part : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
      fine.triangles.push_back(part);
  }
  return fine;
}

Surface icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Surface surface;
  for (const Vec3& corner :
       {Vec3(-1, g, 0), Vec3(1, g, 0), Vec3(-1, -g, 0), Vec3(1, -g, 0), Vec3(0, -1, g), Vec3(0, 1, g), Vec3(0, -1, -g),
        Vec3(0, 1, -g), Vec3(g, 0, -1), Vec3(g, 0, 1), Vec3(-g, 0, -1), Vec3(-g, 0, 1)})
    surface.vertices_mm.push_back(corner.normalized());
  surface.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return surface;
}

// Uterus: an egg whose narrow end (the cervix, +x) is drawn out a little, flatter in z.
Vec3 pear_point(const Vec3& direction) {
  const double x = direction.x();
  const double width = 1 - 0.34 * x - 0.10 * x * x;
  return {x, width * direction.y(), width * direction.z() * (1 - 0.06 * x)};
}

// Heart: apex at -x, a broad base, and the groove between the ventricles.
Vec3 heart_point(const Vec3& direction) {
  const double x = direction.x();
  const double width = 1 + 0.30 * x - 0.18 * x * x;
  const double angle = std::atan2(direction.z(), direction.y()) + 0.7 * x + std::numbers::pi / 2 + 0.5;
  const double off_groove = std::remainder(angle, 2 * std::numbers::pi);
  const double groove = 1 - 0.09 * (1 - x * x) * std::exp(-off_groove * off_groove / 0.08);
  return {x, width * groove * direction.y(), width * groove * direction.z()};
}

// Slab: a box with rounded edges (superellipsoid).
Vec3 slab_point(const Vec3& direction) {
  const double power = 8;
  const double norm = std::pow(direction.array().abs().pow(power).sum(), 1 / power);
  return direction / norm;
}

void fit_to_box(std::vector<Vec3>& points, const Vec3& size) {
  Vec3 min = points.front(), max = points.front();
  for (const Vec3& point : points) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  const Vec3 scale = size.cwiseQuotient(max - min);
  for (Vec3& point : points) point = (point - (min + max) / 2).cwiseProduct(scale);
}

}  // namespace

Mat3 left_from_body(const SimulatedBody& body) {
  const Vec3 angle = body.rotation_deg * std::numbers::pi / 180;
  return (Eigen::AngleAxisd(angle.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angle.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(angle.x(), Vec3::UnitX()))
      .toRotationMatrix();
}

Surface make_sphere(int subdivisions) {
  Surface sphere = icosahedron();
  for (int i = 0; i < subdivisions; ++i) {
    sphere = subdivided(sphere);
    for (Vec3& vertex : sphere.vertices_mm) vertex.normalize();
  }
  return sphere;
}

Surface make_organ(const SimulatedBody& body, int min_triangles) {
  if (body.shape.has_extension()) {
    Surface organ = read_body(body.shape, LengthUnit::mm);
    while (static_cast<int>(organ.triangles.size()) < min_triangles) organ = subdivided(organ);
    return organ;
  }
  int subdivisions = 0;
  while (20 << (2 * subdivisions) < min_triangles) ++subdivisions;
  Surface organ = make_sphere(subdivisions);
  for (Vec3& vertex : organ.vertices_mm)
    vertex = body.shape == "slab"    ? slab_point(vertex)
             : body.shape == "heart" ? heart_point(vertex)
                                     : pear_point(vertex);
  fit_to_box(organ.vertices_mm, body.size_mm);
  const Mat3 turn = left_from_body(body);
  for (Vec3& vertex : organ.vertices_mm) vertex = turn * vertex + body.center_mm;
  return organ;
}

}  // namespace palpate
