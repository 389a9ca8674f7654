#include "palpate/volume/tetrahedralize.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>
#include <CGAL/refine_mesh_3.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "palpate/core/errors.h"
#include "palpate/volume/fit_boundary.h"
#include "palpate/volume/inside.h"
#include "palpate/volume/mesh_quality.h"

namespace palpate {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

constexpr double kWorstDihedral_deg = 10;
constexpr double kAimedDihedral_deg = 12;  // perturbation and exudation stop here
constexpr double kCountTolerance = 0.1;
constexpr int kMaxMeshings = 8;

/// Cell size, as CGAL asks for it: 1 away from the focus, `edge_ratio` inside, growing by a third of the distance.
struct SizeField {
  using FT = Kernel::FT;
  using Point_3 = Triangulation::Bare_point;
  using Index = Domain::Index;
  double size_mm = 1;
  std::optional<MeshFocus> focus;

  FT operator()(const Point_3& p, int, const Index&) const {
    if (!focus) return size_mm;
    const Vec3 here(p.x(), p.y(), p.z());
    double squared = (here - focus->center_mm).squaredNorm();
    for (const Vec3& center : focus->also_around_mm) squared = std::min(squared, (here - center).squaredNorm());
    const double beyond = std::max(0.0, std::sqrt(squared) - focus->radius_mm);
    return std::min(size_mm, focus->edge_ratio * size_mm + beyond / 3);
  }
};

struct Box {
  Vec3 min, max;
};

Box bounds(const Surface& surface) {
  Box box{Vec3::Constant(1e300), Vec3::Constant(-1e300)};
  for (const Vec3& v : surface.vertices_mm) {
    box.min = box.min.cwiseMin(v);
    box.max = box.max.cwiseMax(v);
  }
  return box;
}

/// Points of the surface at least `apart_mm` from each other, to start the refinement from; taken from middles of
/// triangles and only where the surface does bound the body.
std::vector<Vec3> starting_points(const Surface& closed, const InsideTest& inside, double apart_mm) {
  std::vector<Vec3> result;
  for (const Triangle& t : closed.triangles) {
    const Vec3 &a = closed.vertices_mm[static_cast<size_t>(t[0])], &b = closed.vertices_mm[static_cast<size_t>(t[1])],
               &c = closed.vertices_mm[static_cast<size_t>(t[2])];
    const Vec3 middle = (a + b + c) / 3, outwards = (b - a).cross(c - a);
    if (std::any_of(result.begin(), result.end(),
                    [&](const Vec3& taken) { return (taken - middle).squaredNorm() < apart_mm * apart_mm; }))
      continue;
    const Vec3 step = 1e-3 * outwards.normalized();
    if (!step.allFinite() || !inside(middle - step) || inside(middle + step)) continue;
    result.push_back(middle);
  }
  return result;
}

TetMesh mesh_of(const Complex& complex) {
  TetMesh mesh;
  std::unordered_map<const void*, int> number;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    Tetrahedron t{};
    for (int k = 0; k < 4; ++k) {
      const auto vertex = cell->vertex(k);
      const auto [place, is_new] = number.try_emplace(&*vertex, static_cast<int>(mesh.nodes_mm.size()));
      if (is_new) {
        const auto& p = vertex->point().point();
        mesh.nodes_mm.emplace_back(p.x(), p.y(), p.z());
      }
      t[static_cast<size_t>(k)] = place->second;
    }
    mesh.tetrahedra.push_back(t);
  }
  mesh.label.assign(mesh.tetrahedra.size(), 0);
  return mesh;
}

/// One Delaunay refinement with cells of `size_mm`.
Complex refine(const Domain& domain, const std::vector<Vec3>& start, double size_mm,
               const std::optional<MeshFocus>& focus) {
  namespace P = CGAL::parameters;
  const SizeField cell_size{size_mm, focus}, facet_size{0.9 * size_mm, focus}, distance{0.2 * size_mm, focus};
  const Criteria criteria(P::facet_angle = 20, P::facet_size = facet_size, P::facet_distance = distance,
                          P::cell_radius_edge_ratio = 2, P::cell_size = cell_size);
  Complex complex;
  for (const Vec3& p : start) {
    const auto vertex =
        complex.triangulation().insert(Triangulation::Weighted_point(Kernel::Point_3(p.x(), p.y(), p.z())));
    complex.set_dimension(vertex, 2);
    complex.set_index(vertex, domain.index_from_surface_patch_index({0, 1}));
  }
  CGAL::refine_mesh_3(complex, domain, criteria, P::no_perturb(), P::no_exude(), P::manifold());
  return complex;
}

/// Slivers perturbed and exuded, boundary fitted. No clock decides anything here, and the random numbers start anew, so
/// that the same input gives the same mesh.
TetMesh finish(Complex& complex, const Domain& domain, const InsideTest& inside) {
  namespace P = CGAL::parameters;
  CGAL::get_default_random() = CGAL::Random(0);
  CGAL::perturb_mesh_3(complex, domain, P::sliver_bound = kAimedDihedral_deg);
  CGAL::exude_mesh_3(complex, P::sliver_bound = kAimedDihedral_deg);
  TetMesh mesh = without_hinges(mesh_of(complex));
  fit_boundary(mesh, inside, kWorstDihedral_deg + 0.5);
  return mesh;
}

/// Next cell size to try: the count is close to a power law of the size with exponent -3; the last two trials correct
/// it.
class SizeSearch {
 public:
  SizeSearch(double guess_mm, int elements) : size_mm_(guess_mm), elements_(elements) {}

  double size_mm() const { return size_mm_; }

  void tried(int count) {
    if (last_count_ > 0 && count > 0 && count != last_count_ && size_mm_ != last_size_mm_)
      exponent_ =
          std::clamp(std::log(static_cast<double>(last_count_) / count) / std::log(size_mm_ / last_size_mm_), 2.0, 4.5);
    last_count_ = count;
    last_size_mm_ = size_mm_;
    size_mm_ *= count > 0 ? std::pow(static_cast<double>(count) / elements_, 1 / exponent_) : 0.5;
  }

  /// The count was right but the angles were not: a slightly different size makes another mesh.
  void nudge() { size_mm_ = last_size_mm_ * 0.99; }

 private:
  double size_mm_;
  int elements_;
  double exponent_ = 3, last_size_mm_ = 0;
  int last_count_ = 0;
};

}  // namespace

TetMesh tetrahedralize(const Surface& closed_body, int elements, const std::optional<MeshFocus>& focus,
                       MeshReport* report) {
  const double volume = enclosed_volume_mm3(closed_body);
  if (!(volume > 0))
    throw BadInput(fmt::format("the body encloses {:.3g} mm^3, expected a closed surface oriented outwards", volume));
  const Box box = bounds(closed_body);
  const double margin = 0.01 * (box.max - box.min).norm();
  const InsideTest inside(closed_body);
  const auto outside_value = [&inside](const Kernel::Point_3& p) { return inside({p.x(), p.y(), p.z()}) ? -1.0 : 1.0; };
  const Domain domain = Domain::create_implicit_mesh_domain(
      outside_value,
      CGAL::Bbox_3(box.min.x() - margin, box.min.y() - margin, box.min.z() - margin, box.max.x() + margin,
                   box.max.y() + margin, box.max.z() + margin),
      CGAL::parameters::relative_error_bound = 1e-5);

  const double guess_mm = std::cbrt(4.8 * volume / elements);
  const std::vector<Vec3> start = starting_points(closed_body, inside, 1.7 * guess_mm);
  const auto error = [elements](size_t count) {
    return std::abs(static_cast<double>(count) - elements) / static_cast<double>(elements);
  };
  SizeSearch search(guess_mm, elements);
  TetMesh best;
  MeshReport best_report;
  double best_fault = 1e300;
  for (int meshing = 1; meshing <= kMaxMeshings; ++meshing) {
    const double size_mm = search.size_mm();
    Complex complex = refine(domain, start, size_mm, focus);
    const size_t refined = complex.number_of_cells_in_complex();
    const bool is_near = error(refined) <= 0.7 * kCountTolerance;
    search.tried(static_cast<int>(refined));
    if (refined == 0 || (!is_near && meshing < kMaxMeshings)) continue;
    TetMesh mesh = finish(complex, domain, inside);
    const double dihedral = smallest_dihedral_deg(mesh);
    const bool has_count = error(mesh.tetrahedra.size()) <= kCountTolerance;
    const double fault =
        (has_count ? 0 : 100 * error(mesh.tetrahedra.size())) + std::max(0.0, kWorstDihedral_deg - dihedral);
    if (fault < best_fault) {
      best_fault = fault;
      best_report = {static_cast<int>(mesh.tetrahedra.size()), dihedral, size_mm};
      best = std::move(mesh);
    }
    if (best_fault == 0) break;
    if (has_count) search.nudge();
  }
  if (best.tetrahedra.empty())
    throw BadInput(fmt::format("a body of {:.3g} mm^3 cannot be filled with {} tetrahedra", volume, elements));
  if (report) *report = best_report;
  return best;
}

}  // namespace palpate
