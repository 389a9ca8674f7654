#pragma once

#include <memory>

#include "palpate/contact/contact_options.h"
#include "palpate/contact/equilibrium.h"

namespace palpate {

/// A tip that holds tissue, from onset to release: the body (refined around the footprint by the caller), its
/// footprint, the equilibrium of Eq. 3 and the rules of the grip.
class HeldContact {
 public:
  /// `touch_mm`: where the tip met the surface at rest. `fixed_nodes`: attachments of `mesh`.
  HeldContact(const TetMesh& mesh, const std::vector<int>& fixed_nodes, const TissueOptions& tissue,
              const Vec3& touch_mm, const ContactOptions& options, Element element = Element::averaged);
  ~HeldContact();
  HeldContact(HeldContact&&) noexcept;

  struct Answer {
    Equilibrium equilibrium;
    bool let_go = false;  ///< a push whose normal force has reached zero
    bool slid = false;    ///< a push at the edge of its friction cone
  };

  /// Displacement of the tip since onset, left camera frame. A push slides when its tangential force leaves the
  /// friction cone and lets go when its normal force would pull.
  Answer move(const Vec3& displacement_mm);

  const TetModel& model() const;
  const std::vector<Triangle>& boundary() const;
  const Footprint& footprint() const;
  /// An attachment lies within two footprint radii: the stress there is cut off and the force not to be trusted.
  bool near_attachment() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Displacement of the body at points of its rest surface, by the barycentric weights of the nearest triangle, mm.
std::vector<Vec3> displacement_at(const TetModel& model, const std::vector<Triangle>& boundary,
                                  const Eigen::VectorXd& u, const std::vector<Vec3>& rest_points_mm);

}  // namespace palpate
