#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/modulus.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/feedback/forces_file.h"
#include "tests/app/program.h"
#include "tests/support/reference_data.h"

namespace palpate::test {
namespace {

using testing::HasSubstr;

ForceRow loaded(int frame, double force_N, double log_half_width) {
  ForceRow row;
  row.frame = frame;
  row.time_s = 0.04 * frame;
  row.status = "ok";
  row.in_contact = true;
  row.force_magnitude_N = force_N;
  row.force_low_total_N = force_N * std::exp(-log_half_width);
  row.force_high_total_N = force_N * std::exp(log_half_width);
  return row;
}

TEST(Modulus, OfAKnownForceIsTheAssumedOneTimesMeasuredOverEstimated) {
  std::vector<ForceRow> rows;
  for (int i = 0; i < 20; ++i) rows.push_back(loaded(i, 2, 0.2));
  const app::MeasuredModulus found = app::modulus_from_known_force(rows, 10, {3, 0.4});
  EXPECT_NEAR(found.young_modulus_kPa, 15, 1e-9);
  EXPECT_NEAR(found.low_kPa, 15 * std::exp(-0.2), 1e-9);
  EXPECT_NEAR(found.high_kPa, 15 * std::exp(0.2), 1e-9);
}

TEST(Modulus, NeedsAContactAtTheMomentThatIsNamed) {
  std::vector<ForceRow> rows = {loaded(10, 2, 0.1)};
  try {
    app::modulus_from_known_force(rows, 10, {3, 7});
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("7 s"));
    EXPECT_THAT(error.what(), HasSubstr("0.40"));
  }
}

TEST(Modulus, AKnownForceIsWrittenAsForceAtTime) {
  const app::KnownForce known = app::parse_known_force("1.5@3.2");
  EXPECT_EQ(known.force_N, 1.5);
  EXPECT_EQ(known.time_s, 3.2);
  for (const char* text : {"1.5", "1.5@", "@3", "-1@3", "1.5@3s", "nan@1"})
    EXPECT_THROW(app::parse_known_force(text), app::WrongUse) << text;
}

TEST(Modulus, IsWrittenIntoTheSceneAndAllElseIsKept) {
  EXPECT_EQ(
      app::with_modulus("# mine\ntissue:\n  law: linear\n  young_modulus_kPa: unknown  # to be found\n", 12.345, 0.4),
      "# mine\ntissue:\n  law: linear\n  young_modulus_kPa: 12.35  # to be found\n");
  EXPECT_EQ(app::with_modulus("tissue: {young_modulus_kPa: 27, poisson_ratio: 0.45}\nmap: {}\n", 5, 0.45),
            "tissue: {young_modulus_kPa: 5, poisson_ratio: 0.45}\nmap: {}\n");
  EXPECT_EQ(app::with_modulus("tissue: {preset: liver}  # textbook\n", 5, 0.45),
            "tissue: {young_modulus_kPa: 5, poisson_ratio: 0.45}  # textbook\n");
  EXPECT_EQ(app::with_modulus("tissue:\n  preset: \"liver\"\n  law: neo-hookean\n", 5, 0.45),
            "tissue:\n  young_modulus_kPa: 5\n  poisson_ratio: 0.45\n  law: neo-hookean\n");
  EXPECT_THROW(app::with_modulus("tissue: {law: linear}\n", 5, 0.45), BadInput);
}

/// The rendered uterus' scene with its paths made absolute and some texts replaced.
void write_rendered_scene(const std::filesystem::path& to, std::vector<std::pair<std::string, std::string>> changes) {
  const std::filesystem::path folder = reference_data() / "rendered_uterus";
  for (const char* name : {"left.mp4", "right.mp4", "calibration.yaml"})
    changes.emplace_back(name, (folder / name).string());
  std::string text = read_file(folder / "scene.yaml");
  for (const auto& [from, with] : changes) {
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), with);
  }
  write_file(to, text);
}

TEST(Modulus, OfTheRenderedUterusIsFoundFromItsTrueForceAndGivesThatForceBack) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  const Workspace workspace;
  const std::string scene = (workspace / "scene.yaml").string();
  write_rendered_scene(scene, {{"young_modulus_kPa: 400", "young_modulus_kPa: unknown"}});
  ASSERT_THAT(read_file(scene), HasSubstr("unknown"));
  const Outcome unknown = run_palpate("estimate " + scene + " -o " + (workspace / "unknown").string() + " --json");
  ASSERT_EQ(unknown.exit_code, 0) << unknown.error;
  const auto rows = read_forces(workspace / "unknown/forces.csv");
  for (const ForceRow& row : rows) EXPECT_THAT(row.warnings, HasSubstr("modulus_unknown"));
  EXPECT_EQ(nlohmann::json::parse(unknown.output)["tissue"]["young_modulus_kPa"], "unknown");

  const std::string truth = (reference_data() / "rendered_uterus/truth.csv").string();
  const Outcome found = run_palpate("modulus " + scene + " --sensor " + truth + " --write --json");
  ASSERT_EQ(found.exit_code, 0) << found.error;
  const auto json = nlohmann::json::parse(found.output);
  EXPECT_NEAR(json["young_modulus_kPa"].get<double>(), 400, 60);
  EXPECT_LT(json["young_modulus_low_kPa"].get<double>(), 400);
  EXPECT_GT(json["young_modulus_high_kPa"].get<double>(), 400);
  EXPECT_TRUE(std::filesystem::exists(workspace / "scene.modulus.yaml"));
  EXPECT_THAT(read_file(scene), testing::Not(HasSubstr("unknown")));

  const Outcome known =
      run_palpate("estimate " + scene + " -o " + (workspace / "known").string() + " --json --truth " + truth);
  ASSERT_EQ(known.exit_code, 0) << known.error;
  EXPECT_NEAR(nlohmann::json::parse(known.output)["comparison"]["gain"].get<double>(), 1, 0.03);
}

TEST(Program, TellsTheForceFromTheVisibleSurfaceAloneWhereTheOperatorSaysThePlace) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  const Workspace workspace;
  const std::string scene = (workspace / "scene.yaml").string();
  const std::string truth = (reference_data() / "rendered_uterus/truth.csv").string();
  write_rendered_scene(
      scene, {{"contact: {", "contact: {at_px: [396, 176], "}, {"segmentation: colour", "segmentation: none"}});
  const Outcome outcome =
      run_palpate("estimate " + scene + " -o " + (workspace / "out").string() + " --json --truth " + truth);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto figures = nlohmann::json::parse(outcome.output)["comparison"];
  EXPECT_LT(figures["force_nrmse_pct"].get<double>(), 10);
  EXPECT_EQ(figures["false_contact_frames"].get<int>(), 0);
  for (const ForceRow& row : read_forces(workspace / "out/forces.csv")) {
    if (row.status == "ok") {
      EXPECT_THAT(row.warnings, HasSubstr("tip_inferred"));
    }
  }
}

TEST(Program, APlaceOfContactBesideInstrumentsThatAreLookedForIsRefused) {
  const Workspace workspace;
  write_plane_recording(workspace / "in", 2);
  replace_in_file(workspace / "in/scene.yaml", "contact: {", "contact: {at_px: [100, 100], ");
  const Outcome refused =
      run_palpate("estimate " + (workspace / "in/scene.yaml").string() + " -o " + (workspace / "out").string());
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.error, HasSubstr("instrument.segmentation: none"));
}

}  // namespace
}  // namespace palpate::test
