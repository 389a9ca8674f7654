#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "palpate/contact/equilibrium.h"

namespace palpate {

/// A mesh and its attachments.
struct AttachedMesh {
  TetMesh mesh;
  std::vector<int> fixed_nodes;
};

/// Eq. 3 around a state, to first order. Columns: x, y, z of contact 0, of contact 1, ...
struct ContactResponse {
  Equilibrium equilibrium;
  Eigen::MatrixXd motion;                 ///< du/dq of every node (3 n rows)
  Eigen::MatrixXd force;                  ///< dF/dq, N/mm: three rows for each contact
  Eigen::MatrixXd motion_per_log_radius;  ///< du / d log radius of every node, mm: one column for each contact
  Eigen::MatrixXd force_per_log_radius;   ///< dF / d log radius, N: three rows and one column for each contact
};

/// The body with every patch that is held: the forward model F(q, radius) and its derivatives. q is the displacement of
/// a patch from its place at rest, left camera frame of the map.
class ContactModel {
 public:
  /// The body, as fine around these places of its surface at rest as patches there need.
  using MeshAround = std::function<AttachedMesh(const std::vector<Vec3>& places_mm)>;

  ContactModel(MeshAround mesh_around, const TissueOptions& tissue, Element element);
  ~ContactModel();
  ContactModel(ContactModel&&) noexcept;

  size_t contact_count() const;

  /// A contact may begin near here soon: makes the body for it ready in a thread of its own.
  void expect(const Vec3& place_mm, double radius_mm);
  /// One more contact, the last one, at a place of the surface at rest. The mesh changes.
  void begin(const Vec3& place_mm, double radius_mm);
  /// Ends one contact; those after it move up. The mesh stays.
  void end(size_t contact);
  /// A patch elsewhere on the surface at rest. The mesh changes.
  void move(size_t contact, const Vec3& place_mm);
  /// A patch of another size, with all patches at q; the mesh stays. Nothing, and the patch as it was, where that has
  /// no equilibrium.
  std::optional<Equilibrium> set_radius(size_t contact, double radius_mm, const std::vector<Vec3>& q_mm);

  /// Equilibrium at the displacements q, one for each contact (mm), from the last one.
  Equilibrium solve(const std::vector<Vec3>& q_mm);
  /// Factor and derivatives by radius as of the last equilibrium, for what follows.
  void refresh();
  /// Eq. 3 around the last equilibrium; the stiffness is that of the last factorization, the derivatives by radius are
  /// those of the last `refresh` where nothing else has changed.
  ContactResponse respond(const Equilibrium& equilibrium, const std::vector<Vec3>& q_mm);

  const Footprint& footprint(size_t contact) const;
  double radius_mm(size_t contact) const;
  /// Of the patch's middle at rest from the nearest attached node.
  double distance_to_attachments_mm(size_t contact) const;

  const TetModel& model() const;
  const std::vector<Triangle>& boundary() const;
  /// Counts the changes of the mesh.
  int mesh_version() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
