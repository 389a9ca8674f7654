#include "tests/support/punched_dome.h"

#include <cmath>
#include <limits>

#include "palpate/contact/equilibrium.h"
#include "palpate/volume/tetrahedralize.h"
#include "tests/support/calculix.h"

namespace palpate::test {

namespace {
constexpr double kYoungsModulus_kPa = 27;
constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// Mean edge of the surface triangles whose middle the disc covers.
double edge_under_disc_mm(const TetMesh& mesh, double radius_mm) {
  double sum = 0;
  int edges = 0;
  for (const Triangle& t : boundary_triangles(mesh)) {
    const Vec3 &a = mesh.nodes_mm[static_cast<size_t>(t[0])], &b = mesh.nodes_mm[static_cast<size_t>(t[1])],
               &c = mesh.nodes_mm[static_cast<size_t>(t[2])];
    if (((a + b + c) / 3).norm() > radius_mm) continue;
    sum += (a - b).norm() + (b - c).norm() + (c - a).norm();
    edges += 3;
  }
  return edges > 0 ? sum / edges : radius_mm;
}
}  // namespace

TetMesh graded_dome(int elements, double radius_mm) {
  const Surface surface = dome_surface({}, 2);
  double edge_ratio = 0.3;
  for (;;) {
    const MeshFocus focus{Vec3::Zero(), radius_mm, edge_ratio};
    const TetMesh mesh = tetrahedralize(surface, elements, focus);
    if (edge_under_disc_mm(mesh, radius_mm) <= radius_mm / 3 || edge_ratio < 0.05) return mesh;
    edge_ratio *= 0.8;
  }
}

double punch_force_N(const TetMesh& mesh, const PunchReference& punch, Element element) {
  std::vector<int> fixed;
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n)
    if (mesh.nodes_mm[n].z() > Dome{}.depth_mm - 1.5) fixed.push_back(static_cast<int>(n));
  const TetModel model(mesh, {punch.law, kYoungsModulus_kPa, punch.poisson_ratio, ""}, fixed, element);
  EquilibriumSolver solver(model);
  solver.hold(make_footprint(model, boundary_triangles(mesh), Vec3::Zero(), punch.radius_mm));
  const Equilibrium found = solver.solve({0, 0, punch.displacement_mm});
  return found.converged ? found.force_N.norm() : kNoValue;
}

double quadratic_punch_force_N(const PunchReference& punch, int sectors) {
  const Dome dome;
  const TetMesh mesh = quarter_dome(dome, punch.radius_mm, sectors);
  const QuadraticMesh quadratic = with_midside_nodes(mesh);
  constexpr double kOnIt_mm = 1e-9;
  Imposed imposed;
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n) {
    const Vec3& x = mesh.nodes_mm[n];
    Vec3 u = Vec3::Constant(kNoValue);
    if (x.x() < kOnIt_mm) u[0] = 0;
    if (x.y() < kOnIt_mm) u[1] = 0;
    if (x.z() > dome.depth_mm - kOnIt_mm) u.setZero();
    if (std::hypot(x.x(), x.y()) < punch.radius_mm + kOnIt_mm && x.z() < dome.top_z_mm(x.x(), x.y()) + kOnIt_mm)
      u = {0, 0, punch.displacement_mm};
    if (!u.array().isNaN().all()) imposed[static_cast<int>(n)] = u;
  }
  const Imposed all = with_midside_nodes(quadratic, imposed);
  const CalculixAnswer answer =
      run_calculix(quadratic, {punch.law, kYoungsModulus_kPa, punch.poisson_ratio, ""}, all, 0.25);
  double quarter_N = 0;
  for (const auto& [node, u] : all)
    if (u.z() == punch.displacement_mm) quarter_N += answer.reaction[3 * node + 2];
  return 4 * std::abs(quarter_N);
}

}  // namespace palpate::test
