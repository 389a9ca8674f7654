#include "palpate/volume/register_body.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Faces = std::vector<Kernel::Triangle_3>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_triangle_primitive<Kernel, Faces::const_iterator>>>;

constexpr size_t kPointsToStart = 300, kPointsToFinish = 2000;
constexpr int kRoundsToStart = 25, kRoundsToFinish = 60;
constexpr double kTurn = std::numbers::pi / 7;  // between starts
constexpr double kFarthest_mm = 5;              // beyond, a point counts as not matched
constexpr double kMinScale_mm = 0.2;
constexpr double kEdgeOn = -0.05;  // cosine between normal and viewing ray of a face that can be seen

Kernel::Point_3 point(const Vec3& p) {
  return {p.x(), p.y(), p.z()};
}

/// What a closed body answers to "where are you nearest".
class Body {
 public:
  explicit Body(const Surface& surface) {
    for (const Triangle& t : surface.triangles) {
      const Vec3 &a = surface.vertices_mm[static_cast<size_t>(t[0])],
                 &b = surface.vertices_mm[static_cast<size_t>(t[1])],
                 &c = surface.vertices_mm[static_cast<size_t>(t[2])];
      const Vec3 normal = (b - a).cross(c - a);
      if (!(normal.norm() > 0)) continue;
      faces_.emplace_back(point(a), point(b), point(c));
      normals_.push_back(normal.normalized());
    }
    tree_.rebuild(faces_.cbegin(), faces_.cend());
    tree_.accelerate_distance_queries();
  }

  /// Nearest point and the normal of its face, both in the frame of the body.
  std::pair<Vec3, Vec3> nearest(const Vec3& p) const {
    const auto [place, face] = tree_.closest_point_and_primitive(point(p));
    return {{place.x(), place.y(), place.z()}, normals_[static_cast<size_t>(face - faces_.cbegin())]};
  }

 private:
  Faces faces_;
  std::vector<Vec3> normals_;
  Tree tree_;
};

struct Pair {
  Vec3 seen, on_body, normal;  // left camera frame
  bool is_seen = false;        // the face looks at the camera
};

std::vector<Pair> pairs_of(const Body& body, const std::vector<Vec3>& seen, const Registration& motion) {
  std::vector<Pair> pairs(seen.size());
  const Mat3 back = motion.left_from_volume.transpose();
  tbb::parallel_for(size_t{0}, seen.size(), [&](size_t i) {
    const auto [place, normal] = body.nearest(back * (seen[i] - motion.left_from_volume_mm));
    Pair& pair = pairs[i];
    pair = {seen[i], motion.apply(place), motion.left_from_volume * normal, false};
    pair.is_seen =
        pair.normal.dot(pair.on_body.normalized()) < kEdgeOn && (pair.seen - pair.on_body).norm() < 4 * kFarthest_mm;
  });
  return pairs;
}

/// Twice the middle distance of the pairs, as the width of Tukey's weight: wide at first, narrow at the end.
double scale_of(const std::vector<Pair>& pairs) {
  std::vector<double> distances;
  for (const Pair& pair : pairs)
    if (pair.is_seen) distances.push_back(std::abs(pair.normal.dot(pair.seen - pair.on_body)));
  if (distances.empty()) return kFarthest_mm;
  const auto middle = median_of(distances);
  return std::max(kMinScale_mm, 1.5 * middle);
}

/// One Gauss-Newton step on the distances along the normals; returns how far it moved the points, mm.
double step(const std::vector<Pair>& pairs, Registration& motion) {
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Vec6 b = Vec6::Zero();
  Vec3 middle = Vec3::Zero();
  for (const Pair& pair : pairs) middle += pair.seen / static_cast<double>(pairs.size());
  const double reach = 4.5 * scale_of(pairs);
  double radius = 1;
  for (const Pair& pair : pairs) {
    if (!pair.is_seen) continue;
    const double distance = pair.normal.dot(pair.seen - pair.on_body), t = distance / reach;
    if (std::abs(t) >= 1) continue;
    const double weight = (1 - t * t) * (1 - t * t);
    radius = std::max(radius, (pair.on_body - middle).norm());
    Vec6 row;
    row << (pair.on_body - middle).cross(pair.normal), pair.normal;
    A += weight * row * row.transpose();
    b += weight * distance * row;
  }
  // What the points leave free (a sphere's turns) stays where it is.
  A.diagonal().array() += 1e-6 * A.trace() + 1e-9;
  const Vec6 move = A.ldlt().solve(b);
  const Vec3 turn = move.head<3>();
  const double angle = std::min(turn.norm(), 0.3);
  const Mat3 R = angle > 0 ? Eigen::AngleAxisd(angle, turn.normalized()).toRotationMatrix() : Mat3::Identity();
  motion.left_from_volume = R * motion.left_from_volume;
  motion.left_from_volume_mm = R * (motion.left_from_volume_mm - middle) + middle + move.tail<3>();
  return move.tail<3>().norm() + angle * radius;
}

/// Root mean square distance where a point without a face, or farther off, counts as `kFarthest_mm`.
double cost_mm(const std::vector<Pair>& pairs) {
  double sum = 0;
  for (const Pair& pair : pairs) {
    const double distance = pair.is_seen ? (pair.seen - pair.on_body).norm() : kFarthest_mm;
    sum += std::pow(std::min(distance, kFarthest_mm), 2);
  }
  return std::sqrt(sum / static_cast<double>(pairs.size()));
}

Registration iterate(const Body& body, const std::vector<Vec3>& seen, Registration motion, int rounds) {
  for (int round = 0; round < rounds; ++round)
    if (step(pairs_of(body, seen, motion), motion) < 1e-3) break;
  return motion;
}

std::vector<Vec3> every_nth(const std::vector<Vec3>& points, size_t max) {
  std::vector<Vec3> result;
  for (size_t i = 0; i < points.size(); i += points.size() / max + 1) result.push_back(points[i]);
  return result;
}

/// The body turned about its middle, the middle of its visible side laid on that of the points.
Registration with_equal_middles(const Surface& body, const std::vector<Vec3>& seen, const Mat3& turn) {
  Registration motion;
  motion.left_from_volume = turn;
  Vec3 seen_middle = Vec3::Zero(), body_middle = Vec3::Zero();
  for (const Vec3& p : seen) seen_middle += p / static_cast<double>(seen.size());
  double area = 0;
  for (const Triangle& t : body.triangles) {
    const Vec3 a = turn * body.vertices_mm[static_cast<size_t>(t[0])],
               b = turn * body.vertices_mm[static_cast<size_t>(t[1])],
               c = turn * body.vertices_mm[static_cast<size_t>(t[2])];
    // Seen along the ray through the middle of the points, each face with the area that it shows.
    const double shown = -(b - a).cross(c - a).dot(seen_middle.normalized());
    if (shown <= 0) continue;
    area += shown;
    body_middle += shown * (a + b + c) / 3;
  }
  motion.left_from_volume_mm = seen_middle - body_middle / area;
  return motion;
}

}  // namespace

Registration register_body(const Surface& body, const std::vector<Vec3>& seen_mm,
                           const std::optional<Registration>& start) {
  const Body faces(body);
  const std::vector<Vec3> few = every_nth(seen_mm, kPointsToStart), many = every_nth(seen_mm, kPointsToFinish);
  std::vector<Registration> starts;
  if (start) {
    starts.push_back(*start);
  } else {
    starts.push_back(with_equal_middles(body, few, Mat3::Identity()));
    for (int axis = 0; axis < 3; ++axis)
      for (double angle : {-2 * kTurn, -kTurn, kTurn, 2 * kTurn})
        starts.push_back(with_equal_middles(body, few, Eigen::AngleAxisd(angle, Vec3::Unit(axis)).toRotationMatrix()));
  }
  Registration best;
  double min_mm = 1e300;
  for (const Registration& first : starts) {
    const Registration motion = iterate(faces, few, first, kRoundsToStart);
    const double found_mm = cost_mm(pairs_of(faces, few, motion));
    if (found_mm < min_mm) min_mm = found_mm, best = motion;
  }
  best = iterate(faces, many, best, kRoundsToFinish);
  double sum = 0, matched = 0;
  for (const Pair& pair : pairs_of(faces, many, best)) {
    const double distance = (pair.seen - pair.on_body).norm();
    if (!pair.is_seen || distance > kFarthest_mm) continue;
    sum += distance * distance;
    ++matched;
  }
  best.residual_mm = matched > 0 ? std::sqrt(sum / matched) : kFarthest_mm;
  best.matched_fraction = matched / static_cast<double>(many.size());
  return best;
}

}  // namespace palpate
