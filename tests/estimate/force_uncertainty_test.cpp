#include <gtest/gtest.h>

#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/estimate/force_uncertainty.h"
#include "palpate/palpate.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

TEST(TotalBand, IsTheImagesBandWhereNothingElseIsUncertain) {
  const ForceBand band = total_band({0.8, 1.3}, 1, 0);
  EXPECT_NEAR(band.low_N, 0.8, 1e-12);
  EXPECT_NEAR(band.high_N, 1.3, 1e-12);
}

TEST(TotalBand, GrowsByTheFactorThatIsUncertain) {
  const ForceBand band = total_band({1, 1}, 1, std::log(2.0) / 1.96);
  EXPECT_NEAR(band.low_N, 0.5, 1e-12);
  EXPECT_NEAR(band.high_N, 2, 1e-12);
  EXPECT_EQ(total_band({0, 1.5}, 1, 0.1).low_N, 0);
  EXPECT_NEAR(total_band({0, 0.2}, 0, std::log(2.0) / 1.96).high_N, 0.4, 1e-12);
}

struct Uterus {
  Scene scene = read_scene(test::reference_data() / "rendered_uterus/scene.yaml");
  Recording recording{scene.recording};
  Rectification rectification = make_rectification(read_rig(scene.recording), recording.size());
  StereoFrame rest = *recording.next();
  TissueMap map = build_tissue_map(rest, rectification, scene.map, scene.tissue, scene.attachments);

  ForceUncertainty of(const UncertaintyOptions& options) const {
    return force_uncertainty(map, rectification, scene.map, options, scene.contact.footprint_radius_mm);
  }
};

TEST(ForceUncertainty, OfYoungsModulusIsItsFactorEverywhere) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  UncertaintyOptions options;
  options.young_modulus_factor = 1.3;
  EXPECT_NEAR(Uterus().of(options).log_deviation(Vec3(0, 0, 90), Vec3(0, 0, 1)), std::log(1.3), 1e-12);
}

TEST(ForceUncertainty, OfTheAttachmentsGrowsWithWhatIsNotKnownOfThem) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  const Uterus uterus;
  const auto deviation = [&uterus](double attachments_mm) {
    UncertaintyOptions options;
    options.attachments_mm = attachments_mm;
    return uterus.of(options).log_deviation(uterus.map.surface.vertices_mm.front(), Vec3(0, 0, -1));
  };
  EXPECT_EQ(deviation(0), 0);
  EXPECT_GT(deviation(8), deviation(2));
  EXPECT_LT(deviation(8), 1);
}

TEST(ForceUncertainty, OfTheLawGrowsWithTheDisplacement) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  UncertaintyOptions options;
  options.laws = {Law::neo_hookean};
  const Uterus uterus;
  const ForceUncertainty found = uterus.of(options);
  const Vec3 place = found.places.front().at_rest_mm, normal = found.places.front().normal;
  EXPECT_GT(found.log_deviation(place, 2 * normal), found.log_deviation(place, 0.5 * normal));
  EXPECT_LT(found.log_deviation(place, 0.01 * normal), 0.02);
}

TEST(ForceUncertainty, OfTheThicknessOfABodyFromAScanIsRefused) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  Uterus uterus;
  UncertaintyOptions options;
  options.thickness_mm = 3;
  uterus.scene.map.volume = "organ.msh";
  EXPECT_THROW(uterus.of(options), BadInput);
}

}  // namespace
}  // namespace palpate
