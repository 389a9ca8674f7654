#pragma once

#include "palpate/contact/equilibrium.h"
#include "palpate/simulate/truth_motion.h"

namespace palpate {

/// Tissue under a tip that only pushes: a rigid disc that the tissue sticks to as long as the tangential force stays
/// within Coulomb's cone, and that slides over the tissue on its edge; the normal force never pulls. Unlike the
/// estimator's contact the disc takes new tissue beneath it as it slides, so that tissue left behind springs back.
/// Keeps where the disc stands on the tissue and the factored equilibrium.
class PushedTissue {
 public:
  /// `model` is of `body`'s mesh; both have to outlive this.
  PushedTissue(const TetModel& model, const TruthBody& body, const TouchPoint& touch, double friction,
               const EquilibriumOptions& precision);

  struct Answer {
    bool touching = false;
    bool slid = false;        ///< on the edge of the cone
    Equilibrium equilibrium;  ///< where touching
  };

  /// Displacement of the tip from where it touched, left camera frame. Throws BadInput when the disc slides onto
  /// attached tissue or off the body.
  Answer move(const Vec3& displacement_mm);
  /// The tip has left; the next touch begins where the tip is then.
  void leave();

 private:
  Footprint disc_at(const Eigen::Vector2d& place_mm) const;
  void hold(const Eigen::Vector2d& place_mm);

  const TetModel& model_;
  const TruthBody& body_;
  TouchPoint touch_;
  double friction_, spacing_mm_;
  std::vector<Vec3> normals_;
  EquilibriumSolver solver_;
  bool touching_ = false;
  Eigen::Vector2d place_mm_ = Eigen::Vector2d::Zero();  // of the disc, along the tangents of the touch point
  Footprint disc_;
};

}  // namespace palpate
