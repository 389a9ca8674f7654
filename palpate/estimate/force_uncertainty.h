#pragma once

#include <vector>

#include "palpate/estimate/tissue_map.h"
#include "palpate/infer/band.h"

namespace palpate {

/// `uncertainty` of the scene file: what the operator does not know of the tissue, one standard deviation each.
struct UncertaintyOptions {
  double young_modulus_factor = 1;  ///< 1.3 = E is known to a factor of 1.3
  double poisson_ratio = 0;
  double thickness_mm = 0;
  double attachments_mm = 0;  ///< how much nearer to the camera, or farther, they may reach
  std::vector<Law> laws;      ///< that the tissue may have as well
};

void describe(Settings& settings, UncertaintyOptions& options);

/// What the force at a displacement varies by, as the deviation of its logarithm: an ensemble of maps, each with one
/// assumption changed by its deviation, pressed and pulled at places spread over the visible surface.
struct ForceUncertainty {
  struct Place {
    Vec3 at_rest_mm = Vec3::Zero();
    Vec3 normal = Vec3::UnitZ();             ///< outward
    double pressed = 0, pulled = 0;          ///< by Poisson's ratio, thickness, attachments
    double law_pressed = 0, law_pulled = 0;  ///< by the law, at a displacement of `reference_mm`
  };
  double modulus = 0;
  double reference_mm = 1;
  std::vector<Place> places;

  /// Of a patch at this place of the surface at rest that is displaced by q.
  double log_deviation(const Vec3& at_rest_mm, const Vec3& q_mm) const;
};

/// Throws BadInput where an assumption cannot be varied.
ForceUncertainty force_uncertainty(const TissueMap& map, const Rectification& rectification, const MapOptions& options,
                                   const UncertaintyOptions& uncertainty, double radius_mm);

/// The band with a factor of exp(1.96 log_deviation) more on either side, in quadrature of the logarithms.
ForceBand total_band(const ForceBand& from_images, double force_N, double log_deviation);

}  // namespace palpate
