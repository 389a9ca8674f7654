#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/feedback/forces_file.h"
#include "palpate/session/scene_file.h"

namespace palpate::app {

/// A force that is known at one moment of the video: "1.5@3.2" = 1.5 N at 3.2 s.
struct KnownForce {
  double force_N = 0;
  double time_s = 0;
};

/// Throws WrongUse.
KnownForce parse_known_force(const std::string& text);

/// Young's modulus that explains a measured contact, with its 95 % band.
struct MeasuredModulus {
  double young_modulus_kPa = 0;
  double low_kPa = 0, high_kPa = 0;
  int frames = 0;        ///< that it rests on
  std::string measured;  ///< "1.5 N at 3.2 s", "log.csv, clock +0.31 s, correlation 0.98"
};

/// The force is proportional to E: E = assumed E times measured over estimated force. The band is that of the estimate
/// (images, and what `uncertainty` says of the tissue but for E). `estimated`: rows at the modulus `assumed_kPa`. Throw
/// BadInput where the estimate has no force then.
MeasuredModulus modulus_from_known_force(const std::vector<ForceRow>& estimated, double assumed_kPa,
                                         const KnownForce& known);
MeasuredModulus modulus_from_sensor(const std::vector<ForceRow>& estimated, double assumed_kPa,
                                    const std::filesystem::path& log);

/// Text of a scene file with another modulus, all else as it was, comments too; of a preset the two numbers stand in
/// its place. Throws BadInput where the file does not say it in a way that can be replaced.
std::string with_modulus(const std::string& scene_text, double young_modulus_kPa, double poisson_ratio);

}  // namespace palpate::app
