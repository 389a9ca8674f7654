#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/run.h"
#include "bench/accuracy/sequences.h"

namespace palpate {

/// Figures of one estimate against its truth.
struct Measured {
  Comparison figures;
  std::optional<Comparison> second;  ///< of a second instrument
  std::map<std::string, int> frames_by_status;
  int frames = 0;
  int loaded_frames = 0;  ///< true force above 5 % of its peak
  int elements = 0;
  double median_frame_ms = 0;
  double p99_frame_ms = 0;
  /// Where something is wrong, the program says so: more than half of the frames with a force are not ok, or the band
  /// holds the truth in half of them.
  bool flagged = false;
};

/// `changes` are told to the estimator; its results stay in `folder`. Empty, with a sentence on standard error, where
/// the run does not come to an end.
std::optional<Measured> measure(const Sequence& sequence, const std::vector<SceneChange>& changes,
                                const std::filesystem::path& folder);

/// False contact force in % of the peak.
double false_force_pct(const Comparison& figures);

std::string or_dash(const std::optional<double>& value, int digits);
std::string or_dash(const std::optional<int>& value);
/// "52 ok, 30 no_contact".
std::string statuses_text(const Measured& measured);

/// Middle value and largest.
struct Spread {
  double median = 0;
  double worst = 0;
};
Spread spread(std::vector<double> values);

}  // namespace palpate
