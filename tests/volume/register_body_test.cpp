#include "palpate/volume/register_body.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/volume/shapes.h"

namespace palpate {
namespace {

/// An ellipsoid with a bump, so that no turn of it looks like another.
Surface bumpy_body() {
  Surface body = test::ellipsoid({0, 0, 100}, {30, 22, 18}, 4);
  for (Vec3& v : body.vertices_mm) v += 6 * std::exp(-(v - Vec3(12, 8, 85)).squaredNorm() / 80) * Vec3(0.3, 0.2, -1);
  return body;
}

/// The vertices that look at the camera, with noise along the ray.
std::vector<Vec3> seen_points(const Surface& body, double noise_mm) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, noise_mm);
  const std::vector<Vec3> normals = vertex_normals(body.vertices_mm, body.triangles);
  std::vector<Vec3> seen;
  for (size_t i = 0; i < normals.size(); ++i)
    if (normals[i].dot(body.vertices_mm[i].normalized()) < -0.3)
      seen.push_back(body.vertices_mm[i] + noise(random) * body.vertices_mm[i].normalized());
  return seen;
}

Registration motion(const Vec3& axis, double angle, const Vec3& shift) {
  Registration result;
  result.left_from_volume = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  result.left_from_volume_mm = shift;
  return result;
}

Surface moved(Surface body, const Registration& by) {
  for (Vec3& v : body.vertices_mm) v = by.apply(v);
  return body;
}

double largest_error_mm(const Surface& truth, const Surface& given, const Registration& found) {
  double largest = 0;
  for (size_t i = 0; i < truth.vertices_mm.size(); ++i)
    largest = std::max(largest, (found.apply(given.vertices_mm[i]) - truth.vertices_mm[i]).norm());
  return largest;
}

TEST(RegisterBody, FindsAKnownMotionFromEqualMiddles) {
  const Surface truth = bumpy_body();
  const std::vector<Vec3> seen = seen_points(truth, 0.2);
  for (double angle : {0.0, 0.2, 0.6}) {
    const Surface given = moved(truth, motion({0.3, 1, -0.5}, angle, {70, -40, 200}));
    const Registration found = register_body(given, seen);
    EXPECT_LT(largest_error_mm(truth, given, found), 0.3) << "turned by " << angle;
    // 0.2 mm along the ray, less across the surface.
    EXPECT_NEAR(found.residual_mm, 0.14, 0.05);
    EXPECT_GT(found.matched_fraction, 0.98);
    EXPECT_TRUE((found.left_from_volume * found.left_from_volume.transpose()).isIdentity(1e-9));
  }
}

TEST(RegisterBody, StartsWhereTheOperatorSays) {
  const Surface truth = bumpy_body();
  const Registration away = motion({1, 0.2, 0.1}, 2.5, {10, 20, 30});
  const Surface given = moved(truth, away);
  Registration start = motion({1, 0.2, 0.1}, -2.4, Vec3::Zero());
  start.left_from_volume_mm = Vec3(2, -1, 2) - start.left_from_volume * away.left_from_volume_mm;
  EXPECT_LT(largest_error_mm(truth, given, register_body(given, seen_points(truth, 0.1), start)), 0.3);
}

TEST(RegisterBody, IsNotPulledByPointsThatAreNotOnTheBody) {
  const Surface truth = bumpy_body();
  std::vector<Vec3> seen = seen_points(truth, 0.1);
  for (size_t i = 0; i < seen.size(); i += 12) seen[i] += Vec3(0, 0, 9);
  const Surface given = moved(truth, motion({0, 1, 0}, 0.15, {5, 3, -8}));
  const Registration found = register_body(given, seen);
  EXPECT_LT(largest_error_mm(truth, given, found), 0.3);
  EXPECT_LT(found.matched_fraction, 0.95);
}

TEST(RegisterBody, AnotherShapeLeavesAResidual) {
  const std::vector<Vec3> seen = seen_points(bumpy_body(), 0.1);
  EXPECT_GT(register_body(test::box({-10, -10, 60}, {10, 10, 90}), seen).residual_mm, 1);
}

}  // namespace
}  // namespace palpate
