#pragma once

#include <deque>
#include <map>
#include <optional>

#include "palpate/contact/follow.h"
#include "palpate/contact/grip_judge.h"
#include "palpate/contact/held_contact.h"

namespace palpate {

/// One tip on the tissue, from onset to release: what the tip's path and the tissue's motion say about how it holds,
/// whether it still does, and the equilibrium that follows.
class TipContact {
 public:
  /// `held`: begun where the tip met the surface.
  TipContact(HeldContact held, Grip grip);

  enum class State {
    touching,   ///< the tip acts on the tissue
    lifted,     ///< a push that is off the tissue, but not yet away from it
    unsettled,  ///< the tip had not come to rest yet when the contact began (jaws that still closed): begin anew
    over        ///< let go; nothing more is to be asked
  };
  struct Answer {
    State state = State::touching;
    Equilibrium equilibrium;  ///< while touching
    Vec3 tip_mm = Vec3::Zero();
    double misfit_mm = 0;  ///< between the predicted and the seen motion of the tissue, median
    bool slid = false;
    std::optional<Vec3> tied_mm;  ///< displacement of the footprint in this equilibrium; none off the tissue
  };

  /// `measured_mm`: displacement of the tip since onset. `seen`: the tissue around the contact, since onset.
  /// `has_to_be_seen`: the tip was away for so long that it only holds if the tissue shows it.
  Answer update(const Vec3& measured_mm, const std::vector<TissuePoint>& seen, bool has_to_be_seen = false);

  const HeldContact& held() const { return held_; }
  /// `automatic` as long as it cannot be told.
  Grip grip() const { return judge_.grip(); }

 private:
  struct Believed {
    HeldContact::Answer answer;
    std::vector<Vec3> predicted_mm;
  };
  Believed pushed(const Vec3& p_mm, const std::vector<TissuePoint>& seen, const HeldContact::Answer* tied = nullptr);
  Believed grasped(const Vec3& p_mm, const std::vector<TissuePoint>& seen);
  Believed believe(const Vec3& p_mm, const std::vector<TissuePoint>& seen);
  std::vector<Vec3> predicted(const HeldContact::Answer& answer, const std::vector<TissuePoint>& seen);
  State state_of_push(const HeldContact::Answer& answer, const Follow& follow, double height_mm);
  bool lifts(const Follow& follow, double height_mm) const;
  bool is_jump_of_measurement(const Vec3& displacement_mm, const Follow& follow) const;
  bool stays_in_tissue(double height_mm, const Follow& follow);
  bool is_unsettled(const Vec3& displacement_mm, const Follow& if_held, const Follow& as_believed) const;
  bool has_pressed() const;
  double friction_of(const HeldContact::Answer& answer) const;

  /// A point of the tissue before any tip moved it, and where it was moved to before it was first seen.
  struct Origin {
    Vec3 rest_mm, displacement_mm;
  };

  struct Recent {
    double height_mm, seen_mm;
  };

  HeldContact held_;
  Vec3 touch_mm_;
  std::map<int, Origin> origins_;  // by number of the point
  Grip asked_for_;
  GripJudge judge_;
  ReleaseDetector release_;
  Vec3 last_displacement_mm_ = Vec3::Zero();
  Vec3 last_jump_mm_ = Vec3::Zero();  // of the last frame
  Vec3 jumped_mm_ = Vec3::Zero();     // what of the measured displacement the tip did not make
  double last_height_mm_ = 0, last_seen_mm_ = 0;
  int frames_ = 0, pressed_frames_ = 0;
  bool pushes_ = false;  // as believed in this frame
  bool lifted_ = false;
  bool followed_ = false;  // the tissue was seen to move with the tip
  std::deque<Recent> recent_;
  double held_friction_ = 0;  // what the grasp of the last frame would take from a push
  Follow if_held_;            // how the tissue follows if the tip holds it; where that was asked for in this frame
};

}  // namespace palpate
