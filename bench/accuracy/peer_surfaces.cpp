#include "bench/accuracy/peer_surfaces.h"

#define CGAL_EIGEN3_ENABLED 1
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Scale_space_reconstruction_3/Advancing_front_mesher.h>
#include <CGAL/Scale_space_surface_reconstruction_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/grid_simplify_point_set.h>
#include <CGAL/jet_estimate_normals.h>
#include <CGAL/jet_smooth_point_set.h>
#include <CGAL/poisson_surface_reconstruction.h>
#include <CGAL/remove_outliers.h>

namespace palpate::peer {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using PointWithNormal = std::pair<Point, Kernel::Vector_3>;
constexpr int kNeighbours = 24;

std::vector<Point> cgal_points(const std::vector<Vec3>& points_mm) {
  std::vector<Point> points;
  for (const Vec3& p : points_mm) points.emplace_back(p.x(), p.y(), p.z());
  return points;
}

std::vector<Vec3> eigen_points(const std::vector<Point>& points) {
  std::vector<Vec3> result;
  for (const Point& p : points) result.emplace_back(p.x(), p.y(), p.z());
  return result;
}

/// Triangles longer around than this bridge what is open.
constexpr double kLongestPerimeter = 9;  // in spacings

struct Perimeter {
  double longest_mm = 0;

  template <class AdvancingFront, class Cell>
  double operator()(const AdvancingFront& front, Cell& cell, const int& index) const {
    double perimeter = 0;
    for (int k = 1; k < 4; ++k)
      perimeter += std::sqrt(CGAL::squared_distance(cell->vertex((index + k) % 4)->point(),
                                                    cell->vertex((index + k % 3 + 1) % 4)->point()));
    return perimeter > longest_mm ? front.infinity() : front.smallest_radius_delaunay_sphere(cell, index);
  }
};

bool is_near(const Vec3& p, const std::vector<Vec3>& points, double distance_mm) {
  return std::any_of(points.begin(), points.end(),
                     [&](const Vec3& other) { return (p - other).squaredNorm() < distance_mm * distance_mm; });
}

}  // namespace

std::vector<Vec3> tidied(const std::vector<Vec3>& points_mm, double spacing_mm) {
  std::vector<Point> points = cgal_points(points_mm);
  points.erase(CGAL::remove_outliers<CGAL::Parallel_if_available_tag>(points, kNeighbours,
                                                                      CGAL::parameters::threshold_percent(5.0)),
               points.end());
  points.erase(CGAL::grid_simplify_point_set(points, spacing_mm), points.end());
  CGAL::jet_smooth_point_set<CGAL::Parallel_if_available_tag>(points, kNeighbours);
  return eigen_points(points);
}

Surface advancing_front(const std::vector<Vec3>& points_mm, double spacing_mm) {
  const std::vector<Point> points = cgal_points(points_mm);
  std::vector<std::array<std::size_t, 3>> facets;
  CGAL::advancing_front_surface_reconstruction(points.begin(), points.end(), std::back_inserter(facets),
                                               Perimeter{kLongestPerimeter * spacing_mm});
  Surface surface{points_mm, {}};
  for (const auto& f : facets)
    surface.triangles.push_back({static_cast<int>(f[0]), static_cast<int>(f[1]), static_cast<int>(f[2])});
  return without_unused_vertices(surface);
}

Surface scale_space(const std::vector<Vec3>& points_mm, double spacing_mm) {
  const std::vector<Point> points = cgal_points(points_mm);
  CGAL::Scale_space_surface_reconstruction_3<Kernel> reconstruction(points.begin(), points.end());
  reconstruction.increase_scale(4);
  reconstruction.reconstruct_surface(
      CGAL::Scale_space_reconstruction_3::Advancing_front_mesher<Kernel>(kLongestPerimeter / 3 * spacing_mm));
  // The facets of the smoothed points are laid over the points as they came in.
  Surface surface{points_mm, {}};
  for (auto f = reconstruction.facets_begin(); f != reconstruction.facets_end(); ++f)
    surface.triangles.push_back({static_cast<int>((*f)[0]), static_cast<int>((*f)[1]), static_cast<int>((*f)[2])});
  return without_unused_vertices(surface);
}

Surface poisson(const std::vector<Vec3>& points_mm, double spacing_mm) {
  std::vector<PointWithNormal> points;
  for (const Point& p : cgal_points(points_mm)) points.emplace_back(p, Kernel::Vector_3());
  const CGAL::First_of_pair_property_map<PointWithNormal> point_map;
  const CGAL::Second_of_pair_property_map<PointWithNormal> normal_map;
  CGAL::jet_estimate_normals<CGAL::Parallel_if_available_tag>(
      points, kNeighbours, CGAL::parameters::point_map(point_map).normal_map(normal_map));
  for (auto& [point, normal] : points)
    if (normal * (point - CGAL::ORIGIN) > 0) normal = -normal;
  CGAL::Surface_mesh<Point> mesh;
  constexpr double kAngle_deg = 20, kTriangle = 30, kChord = 0.2;  // of the triangles; the last two in spacings
  // CGAL's surface mesher gives up on some inputs.
  try {
    if (!CGAL::poisson_surface_reconstruction_delaunay(points.begin(), points.end(), point_map, normal_map, mesh,
                                                       spacing_mm, kAngle_deg, kTriangle, kChord))
      return {};
  } catch (const CGAL::Failure_exception&) {
    return {};
  }
  Surface surface;
  for (const auto v : mesh.vertices())
    surface.vertices_mm.emplace_back(mesh.point(v).x(), mesh.point(v).y(), mesh.point(v).z());
  std::vector<char> near;
  for (const Vec3& v : surface.vertices_mm) near.push_back(is_near(v, points_mm, 2 * spacing_mm));
  for (const auto f : mesh.faces()) {
    Triangle t{};
    size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) t[k++] = static_cast<int>(v);
    if (std::all_of(t.begin(), t.end(), [&](int v) { return near[static_cast<size_t>(v)]; }))
      surface.triangles.push_back(t);
  }
  return without_unused_vertices(surface);
}

}  // namespace palpate::peer
