#pragma once

#include <memory>
#include <optional>

#include "palpate/contact/contact_options.h"
#include "palpate/contact/touched_body.h"

namespace palpate {

/// A tip on the tissue, from onset to release: its footprint on a body that it may share with other tips, and what each
/// grip makes of the tip's path. Displacements are those of the tip from the footprint's rest position, left camera
/// frame.
class HeldContact {
 public:
  /// `touch_mm`: where the tip met the surface, as a place of the surface at rest.
  HeldContact(std::shared_ptr<TouchedBody> body, const Vec3& touch_mm, const ContactOptions& options);
  ~HeldContact();
  HeldContact(HeldContact&&) noexcept;
  HeldContact& operator=(HeldContact&&) noexcept;

  struct Answer {
    Equilibrium equilibrium;
    bool let_go = false;          ///< a push whose tip is off the tissue
    bool slid = false;            ///< a push at the edge of its friction cone
    std::optional<Vec3> tied_mm;  ///< displacement of the footprint in this equilibrium; none off the tissue
  };

  /// The tissue goes where the tip goes.
  Answer grasp(const Vec3& displacement_mm);
  /// The tip presses on the tissue and never pulls (one-sided normal force); it slides over the surface when the
  /// tangential force leaves Coulomb's cone. `tied`: the answer of `grasp` to the same displacement where it is known
  /// already; within the cone and without a slide before, both are the same.
  Answer push(const Vec3& displacement_mm, const Answer* tied = nullptr);

  /// The coefficient of friction was seen to be at least this.
  void raise_friction(double coefficient);

  /// As the options' grip says; `automatic` ties.
  Answer move(const Vec3& displacement_mm);

  /// Where the tip stands on the surface at rest, left camera frame: the middle of the footprint, from where a push has
  /// slid.
  const Vec3& place_mm() const;
  /// A push has slid so far that it stands on other tissue than its footprint.
  bool has_left_its_footprint() const;
  /// The footprint lies where the tip stands from now on.
  void move_footprint();

  const TouchedBody& body() const;
  /// Of this tip on the body.
  int number() const;
  const Footprint& footprint() const;
  /// By how much another tip had displaced the tissue where this one touched.
  const Vec3& displaced_at_begin_mm() const;
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
