#pragma once

#include <cstddef>

namespace palpate {

struct Belief;
struct ForceAt;

/// How much of what is not known of a frame's force comes from each nuisance unknown: multiple correlation
/// of the force along its own direction with the unknowns of each kind, 0 (nothing) to 1 (all of it).
struct ForceCorrelation {
  double scene_motion = 0;
  double disparity_bias = 0;
  double offset = 0;  ///< of tip and patch
  double radius = 0;
  double skew = 0;
};

ForceCorrelation force_correlation(const ForceAt& force, const Belief& posterior, size_t contact);

}  // namespace palpate
