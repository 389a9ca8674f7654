#pragma once

#include <memory>

#include "palpate/contact/contact_options.h"
#include "palpate/contact/equilibrium.h"

namespace palpate {

/// A tip on the tissue, from onset to release: the body (refined around the footprint by the caller), its footprint,
/// the equilibrium of Eq. 3 and what each grip makes of the tip's path. Displacements are those of the tip from the
/// footprint's rest position, left camera frame.
class HeldContact {
 public:
  /// `touch_mm`: where the tip met the surface at rest. `fixed_nodes`: attachments of `mesh`.
  HeldContact(const TetMesh& mesh, const std::vector<int>& fixed_nodes, const TissueOptions& tissue,
              const Vec3& touch_mm, const ContactOptions& options, Element element = Element::averaged);
  ~HeldContact();
  HeldContact(HeldContact&&) noexcept;
  HeldContact& operator=(HeldContact&&) noexcept;

  struct Answer {
    Equilibrium equilibrium;
    bool let_go = false;  ///< a push whose tip is off the tissue, which is at rest
    bool slid = false;    ///< a push at the edge of its friction cone
  };

  /// The tissue goes where the tip goes.
  Answer grasp(const Vec3& displacement_mm);
  /// The tip presses on the tissue and never pulls (one-sided normal force); it slides over the surface when the
  /// tangential force leaves Coulomb's cone. `tied`: the answer of `grasp` to the same displacement where it is known
  /// already; within the cone and without a slide before, both are the same.
  Answer push(const Vec3& displacement_mm, const Answer* tied = nullptr);

  /// As the options' grip says; `automatic` ties.
  Answer move(const Vec3& displacement_mm);

  /// Where the tip stands on the surface at rest, left camera frame: the middle of the footprint, from where a push has
  /// slid. The footprint itself stays; from half its radius on the contact is better begun anew at this place.
  const Vec3& place_mm() const;
  bool has_left_its_footprint() const;

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
