#pragma once

#include <map>
#include <optional>
#include <vector>

#include "palpate/contact/contact_options.h"
#include "palpate/contact/tissue_motion.h"

namespace palpate {

/// Tells how a tip holds the tissue, by what happens: a tip that slides over the tissue or leaves it pushes, one that
/// takes the tissue along grasps it. As long as both would move the tissue alike they give the same force and nothing
/// can be told. Once told, it stays.
class GripJudge {
 public:
  /// Begins a contact. Anything but `automatic` is known from the start.
  void start(Grip grip);

  /// One frame: motion of the tissue as predicted if the tip only pushes and if it holds, at the rest position of each
  /// point. Compared is what has moved since both last agreed, so that what they have in common does not count.
  void update(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& pushed_mm,
              const std::vector<Vec3>& grasped_mm);

  /// `automatic` as long as it cannot be told.
  Grip grip() const { return grip_; }
  /// Where between the two predictions the tissue was seen in the last frame that could tell: 0 = as pushed, 1 = as
  /// grasped; nothing before.
  const std::optional<double>& share() const { return share_; }

 private:
  struct Motion {
    Vec3 seen_mm, pushed_mm, grasped_mm;
  };
  Grip grip_ = Grip::automatic;
  std::optional<double> share_;
  int pushing_frames_ = 0, grasping_frames_ = 0;  // in a row
  std::map<int, Motion> agreed_;                  // by number of the point; empty: at onset, when nothing had moved
};

}  // namespace palpate
