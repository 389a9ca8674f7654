#include "palpate/surface/cocone.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/surface/manifold.h"

namespace palpate {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

/// Dual of a cell: its circumcentre, or for an infinite cell the direction that leaves its hull facet.
struct VoronoiVertex {
  Vec3 value = Vec3::Zero();
  bool at_infinity = false;
};

using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<int, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<VoronoiVertex, Kernel, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

const double kSineOfCocone = std::sin(std::numbers::pi / 8);  // half opening angle of the cocone, as in the paper
constexpr double kLongestEdge = 3.0;  // of a candidate triangle, in distances between neighbours

Vec3 vec(const Kernel::Point_3& p) {
  return {p.x(), p.y(), p.z()};
}

/// Centre of the sphere through four points; for flat ones a point far off along their normal.
VoronoiVertex circumcentre(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 ab = b - a, ac = c - a, ad = d - a;
  const double det = ab.dot(ac.cross(ad));
  const Vec3 offset =
      ad.squaredNorm() * ab.cross(ac) + ac.squaredNorm() * ad.cross(ab) + ab.squaredNorm() * ac.cross(ad);
  if (std::abs(det) * 1e12 < offset.norm()) return {offset.normalized() * (det < 0 ? -1 : 1), true};
  return {a + offset / (2 * det), false};
}

void compute_duals(Delaunay& delaunay) {
  for (auto cell = delaunay.all_cells_begin(); cell != delaunay.all_cells_end(); ++cell) {
    const auto point = [&](int i) { return vec(cell->vertex(i)->point()); };
    int infinite = -1;
    for (int i = 0; i < 4; ++i)
      if (delaunay.is_infinite(cell->vertex(i))) infinite = i;
    if (infinite < 0) {
      cell->info() = circumcentre(point(0), point(1), point(2), point(3));
      continue;
    }
    const auto corner = [&](int k) { return point(Delaunay::vertex_triple_index(infinite, k)); };
    Vec3 outwards = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    const auto inner = cell->neighbor(infinite);
    const Vec3 inside = vec(inner->vertex(inner->index(cell))->point());
    if (outwards.dot(inside - corner(0)) > 0) outwards = -outwards;
    cell->info() = {outwards, true};
  }
}

/// The pole of a sample is the farthest vertex of its Voronoi cell; only its line matters here. Of an unbounded cell,
/// as samples on an open surface often have, it is the direction that the unbounded edges share.
Vec3 pole_direction(const Delaunay& delaunay, Delaunay::Vertex_handle vertex,
                    std::vector<Delaunay::Cell_handle>& cells) {
  cells.clear();
  delaunay.incident_cells(vertex, std::back_inserter(cells));
  const Vec3 p = vec(vertex->point());
  Vec3 farthest = Vec3::Zero();
  Mat3 unbounded = Mat3::Zero();
  for (const auto& cell : cells) {
    const VoronoiVertex& dual = cell->info();
    if (dual.at_infinity)
      unbounded += dual.value * dual.value.transpose();
    else if ((dual.value - p).squaredNorm() > farthest.squaredNorm())
      farthest = dual.value - p;
  }
  if (unbounded.isZero()) return farthest.normalized();
  return Eigen::SelfAdjointEigenSolver<Mat3>(unbounded).eigenvectors().col(2);
}

struct Neighbours {
  std::vector<std::vector<int>> of;  ///< Delaunay neighbours within `kLongestEdge` times the spacing
  double spacing_mm = 0;             ///< median distance to the nearest neighbour
};

Neighbours find_neighbours(const Delaunay& delaunay, const std::vector<Vec3>& points) {
  std::vector<double> nearest(points.size(), 1e300);
  const auto for_each_edge = [&](auto visit) {
    for (auto edge = delaunay.finite_edges_begin(); edge != delaunay.finite_edges_end(); ++edge) {
      const int a = edge->first->vertex(edge->second)->info(), b = edge->first->vertex(edge->third)->info();
      visit(static_cast<size_t>(a), static_cast<size_t>(b),
            (points[static_cast<size_t>(a)] - points[static_cast<size_t>(b)]).norm());
    }
  };
  for_each_edge([&](size_t a, size_t b, double length) {
    nearest[a] = std::min(nearest[a], length);
    nearest[b] = std::min(nearest[b], length);
  });
  Neighbours result;
  std::vector<double> sorted;
  for (double distance : nearest)
    if (distance < 1e300) sorted.push_back(distance);
  result.spacing_mm = median_of(sorted);
  result.of.resize(points.size());
  for_each_edge([&](size_t a, size_t b, double length) {
    if (length > kLongestEdge * result.spacing_mm) return;
    result.of[a].push_back(static_cast<int>(b));
    result.of[b].push_back(static_cast<int>(a));
  });
  // CGAL walks its edges in the order of their addresses, which differ from run to run.
  for (std::vector<int>& neighbours : result.of) std::sort(neighbours.begin(), neighbours.end());
  return result;
}

/// At an open boundary Voronoi cells open sideways and the pole may lie in the surface; a pole line that departs from
/// what the neighbours say by more than 30 degrees is replaced by theirs.
std::vector<Vec3> agreed_poles(const std::vector<Vec3>& poles, const Neighbours& neighbours) {
  std::vector<Vec3> agreed = poles;
  for (size_t i = 0; i < poles.size(); ++i) {
    if (neighbours.of[i].size() < 3) continue;
    Mat3 lines = Mat3::Zero();
    for (int j : neighbours.of[i]) lines += poles[static_cast<size_t>(j)] * poles[static_cast<size_t>(j)].transpose();
    const Vec3 common = Eigen::SelfAdjointEigenSolver<Mat3>(lines).eigenvectors().col(2);
    if (std::abs(common.dot(poles[i])) < 0.87) agreed[i] = common;
  }
  return agreed;
}

/// Whether the dual Voronoi edge of a facet meets the cocone of sample `p`: the double cone's complement about the pole
/// line, here by the sines of both ends of the edge over the tangent plane.
bool meets_cocone(const Vec3& p, const Vec3& pole, const VoronoiVertex& one, const VoronoiVertex& other) {
  const auto sine = [&](const VoronoiVertex& end) {
    if (end.at_infinity) return end.value.dot(pole);
    const Vec3 to_end = end.value - p;
    return to_end.dot(pole) / std::max(to_end.norm(), 1e-300);
  };
  const double s = sine(one), t = sine(other);
  return s * t <= 0 || std::min(std::abs(s), std::abs(t)) <= kSineOfCocone;
}

std::vector<Triangle> candidate_triangles(const Delaunay& delaunay, const std::vector<Vec3>& points,
                                          const std::vector<Vec3>& poles, double longest_edge,
                                          const DepthEdges* edges) {
  std::vector<Triangle> candidates;
  for (auto facet = delaunay.finite_facets_begin(); facet != delaunay.finite_facets_end(); ++facet) {
    const auto cell = facet->first;
    Triangle t{};
    for (int k = 0; k < 3; ++k)
      t[static_cast<size_t>(k)] = cell->vertex(Delaunay::vertex_triple_index(facet->second, k))->info();
    bool is_candidate = true;
    for (size_t k = 0; k < 3 && is_candidate; ++k) {
      const auto a = static_cast<size_t>(t[k]), b = static_cast<size_t>(t[(k + 1) % 3]);
      is_candidate = (points[a] - points[b]).norm() <= longest_edge &&
                     meets_cocone(points[a], poles[a], cell->info(), cell->neighbor(facet->second)->info());
    }
    for (size_t k = 0; k < 3 && is_candidate && edges; ++k)
      is_candidate = !is_torn(*edges, points[static_cast<size_t>(t[k])], points[static_cast<size_t>(t[(k + 1) % 3])]);
    if (is_candidate) candidates.push_back(t);
  }
  return candidates;
}

}  // namespace

Surface cocone(const std::vector<Vec3>& points_mm, const SurfaceOptions& options, const DepthEdges* edges) {
  std::vector<std::pair<Kernel::Point_3, int>> numbered;
  for (size_t i = 0; i < points_mm.size(); ++i)
    if (points_mm[i].allFinite())
      numbered.emplace_back(Kernel::Point_3(points_mm[i].x(), points_mm[i].y(), points_mm[i].z()), static_cast<int>(i));
  Delaunay delaunay(numbered.begin(), numbered.end());
  if (delaunay.dimension() < 3)
    throw BadInput(fmt::format("no surface through {} points: they lie in one plane or are too few", points_mm.size()));
  compute_duals(delaunay);

  std::vector<Vec3> poles(points_mm.size(), Vec3::UnitZ());
  std::vector<Delaunay::Cell_handle> cells;
  for (auto vertex = delaunay.finite_vertices_begin(); vertex != delaunay.finite_vertices_end(); ++vertex)
    poles[static_cast<size_t>(vertex->info())] = pole_direction(delaunay, vertex, cells);
  const Neighbours neighbours = find_neighbours(delaunay, points_mm);
  for (int round = 0; round < 2; ++round) poles = agreed_poles(poles, neighbours);

  Surface surface;
  surface.vertices_mm = points_mm;
  surface.triangles = extract_manifold(
      points_mm, candidate_triangles(delaunay, points_mm, poles, kLongestEdge * neighbours.spacing_mm, edges));
  if (surface.triangles.empty())
    throw BadInput(fmt::format("no surface through {} points: no three neighbours form a surface", points_mm.size()));
  return close_holes(without_unused_vertices(surface), std::numbers::pi * options.largest_hole_mm, edges);
}

}  // namespace palpate
