#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/accuracy/sequences.h"

namespace palpate {

/// What is asked of the force, in % of the true peak unless said otherwise.
struct Goal {
  double median_pct = 7;
  double worst_pct = 7;            ///< over the seeds
  bool shape = false;              ///< also gain 0.95 - 1.05 and direction within 5 degrees
  bool between = false;            ///< also no more than 3 % of force between contacts
  bool no_worse_than_tip = false;  ///< instead of a figure: than contact.drive tip, or flagged

  std::string text() const;
};

/// One line of what must hold: sequences, how they are made and what the estimator is told.
struct Check {
  std::string name;
  std::string what;
  std::vector<std::string> sequences;
  std::vector<SceneChange> made_with;  ///< DejaVu's scene
  std::function<std::vector<SceneChange>(const Sequence& sequence, const std::filesystem::path& folder)> told;
  Goal goal;
};

/// Every check on sequences with known force. `folder` given to `told` may take files that it names.
std::vector<Check> all_checks();

/// The goal of one sequence: that of its check but for what its truth cannot say.
Goal goal_of(const Check& check, const std::string& sequence);

}  // namespace palpate
