#include <algorithm>
#include <cstdio>

#include "palpate/contact/equilibrium.h"
#include "palpate/volume/body.h"
#include "palpate/volume/tetrahedralize.h"

/// Force of a rigid disc of 3 mm that is pushed into an organ, clamped where it is farthest from the camera.
int main(int, char** arguments) {
  using namespace palpate;
  const TetMesh mesh = tetrahedralize(read_body(arguments[1], LengthUnit::mm), 1344);
  double near_mm = mesh.nodes_mm[0].z(), far_mm = near_mm;
  Vec3 touched_mm = mesh.nodes_mm[0];
  for (const Vec3& node : mesh.nodes_mm) {
    if (node.z() <= near_mm) touched_mm = node;
    near_mm = std::min(near_mm, node.z());
    far_mm = std::max(far_mm, node.z());
  }
  std::vector<int> clamped;
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n)
    if (mesh.nodes_mm[n].z() > far_mm - 5) clamped.push_back(static_cast<int>(n));

  const TetMesh refined = refine_near(mesh, touched_mm, 3, 3);  // keeps the numbers of the nodes
  const TetModel model(refined, {Law::neo_hookean, 27, 0.45, ""}, clamped, Element::averaged);
  EquilibriumSolver solver(model);
  solver.hold(make_footprint(model, boundary_triangles(refined), touched_mm, 3));
  for (double depth_mm : {0.5, 1.0, 1.5, 2.0}) {
    const Equilibrium state = solver.solve({0, 0, depth_mm});
    if (!state.converged || !model.in_valid_range(state.u)) return 1;
    std::printf("%.1f mm: %.3f N, a little deeper %.3f N/mm more\n", depth_mm, state.force_N.z(),
                solver.contact_stiffness().stiffness_N_per_mm(2, 2));
  }
}
