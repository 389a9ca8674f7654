#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/modulus.h"
#include "app/run.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"

namespace palpate::app {

namespace {

std::string modulus_yaml(const MeasuredModulus& found, const TissueOptions& tissue) {
  return fmt::format(
      "# Young's modulus from one measured contact; palpate {}\n"
      "tissue:\n  law: {}\n  young_modulus_kPa: {:.4g}\n  poisson_ratio: {:g}\n"
      "measured:\n  young_modulus_low_kPa: {:.4g}    # 95 % band\n  young_modulus_high_kPa: {:.4g}\n  frames: {}\n"
      "  from: \"{}\"\n",
      PALPATE_VERSION, law_name(tissue.law), found.young_modulus_kPa, tissue.poisson_ratio, found.low_kPa,
      found.high_kPa, found.frames, found.measured);
}

}  // namespace

void add_modulus(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, sensor;
    std::string known_force;
    bool write = false, json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("modulus", "Young's modulus of the tissue from one measured contact");
  verb->add_option("scene", arguments->scene, "scene.yaml")->required()->type_name("SCENE");
  auto* sensor = verb->add_option("--sensor", arguments->sensor,
                                  "log of a force sensor (time_s, fx_N, fy_N, fz_N), with its own clock and axes")
                     ->type_name("FILE");
  verb->add_option("--known-force", arguments->known_force, "force in N at a time of the video in s: 1.5@3.2")
      ->type_name("N@S")
      ->excludes(sensor);
  verb->add_flag("--write", arguments->write, "write the modulus into the scene file, all else kept as it is");
  verb->add_flag("--json", arguments->json, "figures as JSON on standard output, no progress");
  verb->footer(
      "Writes SCENE.modulus.yaml beside the scene.\nExample: palpate modulus scene.yaml --known-force 1.5@3.2 --write");
  verb->callback([arguments] {
    if (arguments->sensor.empty() == arguments->known_force.empty())
      throw WrongUse("modulus needs either --sensor LOG or --known-force N@S");
    const KnownForce known = arguments->known_force.empty() ? KnownForce{} : parse_known_force(arguments->known_force);
    SceneFile scene_file = read_scene_file(arguments->scene, true);
    const TissueOptions& tissue = scene_file.scene.tissue;
    if (arguments->write) with_modulus(read_whole_file(arguments->scene), 1, tissue.poisson_ratio);
    scene_file.scene.uncertainty.young_modulus_factor = 1;  // it is what is asked
    const std::vector<ForceRow> rows = estimate_rows(scene_file, arguments->json);
    const MeasuredModulus found = arguments->sensor.empty()
                                      ? modulus_from_known_force(rows, tissue.young_modulus_kPa, known)
                                      : modulus_from_sensor(rows, tissue.young_modulus_kPa, arguments->sensor);
    std::filesystem::path written = arguments->scene;
    written.replace_extension(".modulus.yaml");
    write_whole_file(written, modulus_yaml(found, tissue));
    if (arguments->write)
      write_whole_file(arguments->scene,
                       with_modulus(read_whole_file(arguments->scene), found.young_modulus_kPa, tissue.poisson_ratio));
    if (arguments->json) {
      fmt::print("{}", json_success({{"young_modulus_kPa", found.young_modulus_kPa},
                                     {"young_modulus_low_kPa", found.low_kPa},
                                     {"young_modulus_high_kPa", found.high_kPa},
                                     {"law", law_name(tissue.law)},
                                     {"poisson_ratio", tissue.poisson_ratio},
                                     {"frames", found.frames},
                                     {"measured", found.measured},
                                     {"written", written.string()}}));
      return;
    }
    fmt::print("Young's modulus       {:.4g} kPa (95 %: {:.4g} to {:.4g}), {}, nu = {:g}\n", found.young_modulus_kPa,
               found.low_kPa, found.high_kPa, law_name(tissue.law), tissue.poisson_ratio);
    fmt::print("from                  {}, {} frames\n", found.measured, found.frames);
    fmt::print("written to            {}{}\n", written.string(),
               arguments->write ? " and " + arguments->scene.string() : "");
  });
}

}  // namespace palpate::app
