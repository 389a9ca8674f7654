#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "palpate/contact/equilibrium.h"

namespace palpate {

/// A mesh and its attachments.
struct AttachedMesh {
  TetMesh mesh;
  std::vector<int> fixed_nodes;
};

/// One body with every tip that is on it: as many footprints, one equilibrium (Eq. 3). Tips have numbers that stay
/// until they end; displacements are those of a tip from its footprint's rest position, left camera frame.
class TouchedBody {
 public:
  /// The body, as fine around these places of its surface at rest as a footprint there needs.
  using MeshAround = std::function<AttachedMesh(const std::vector<Vec3>& places_mm)>;

  TouchedBody(MeshAround mesh_around, const TissueOptions& tissue, Element element, double footprint_radius_mm);
  ~TouchedBody();
  TouchedBody(TouchedBody&&) noexcept;

  /// A tip begins at a place of the surface at rest, on the tissue as it is now, which it changes nothing about yet.
  /// Returns its number.
  int begin(const Vec3& place_mm);
  /// A tip's footprint lies elsewhere from now on.
  void move_footprint(int tip, const Vec3& place_mm);
  void end(int tip);

  /// With this tip displaced and the others where they are. `contacts` of the answer are by tip number (no force where
  /// a number is not on the tissue), `force_N` and `mean_nodal_force_N` those of this tip.
  Equilibrium solve(int tip, const Vec3& displacement_mm);
  /// The same as if this tip were off the tissue.
  Equilibrium solve_without(int tip);

  const Footprint& footprint(int tip) const;
  /// By how much the tissue was displaced where this tip began.
  const Vec3& displaced_at_begin_mm(int tip) const;
  /// Of the footprint's middle at rest from the nearest attached node.
  double distance_to_attachments_mm(int tip) const;

  /// The mesh changes with each beginning and each footprint that moves.
  const TetModel& model() const;
  const std::vector<Triangle>& boundary() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
