#include "bench/accuracy/sequences.h"

#include <fmt/format.h>

#include <cstdlib>

#include "app/simulation.h"
#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"

namespace palpate {
namespace {

// What a recording was made of; named so last, so that one that was not finished is made again.
constexpr const char* kMadeOf = "made_of.yaml";
constexpr int kSeedStep = 100;  // seeds of different looks are far apart

}  // namespace

bool is_rendered(const YAML::Node& scene, const std::filesystem::path& folder) {
  return read_whole_file(folder / kMadeOf) == scene_text(scene);
}

Sequence rendered(const std::string& name, const YAML::Node& scene, const std::filesystem::path& folder) {
  if (!is_rendered(scene, folder)) {
    fmt::print(stderr, "rendering {}\n", name);
    const std::filesystem::path asked = folder / "asked.yaml";
    std::filesystem::remove(folder / kMadeOf);
    save_scene(scene, asked);
    DejaVuSummary summary;
    app::simulate_into(read_scene_file(asked, false), folder, true, summary);
    std::filesystem::rename(asked, folder / kMadeOf);
  }
  return {name, load_scene(folder / "scene.yaml"), folder / "truth.csv"};
}

YAML::Node dejavu_text(const SceneFile& scene) {
  const YAML::Node whole = YAML::Load(write_scene_file(scene));
  std::vector<SceneChange> told;
  for (const char* key : {"simulate", "tissue", "attachments", "map.elements", "contact.footprint_radius_mm",
                          "contact.friction", "contact.grip"})
    told.push_back({key, value_at(whole, key)});
  return changed(YAML::Node(YAML::NodeType::Map), told);
}

std::vector<std::string> static_sequences() {
  return {"rendered_uterus", "rendered_liver", "demo",       "uterus",
          "liver_slab",      "heart",          "liver_push", "two_instruments"};
}

bool is_dejavu(const std::string& name) {
  return !name.starts_with("rendered_");
}

YAML::Node dejavu_scene(const std::string& name, int seed) {
  const YAML::Node scene = name == "demo"
                               ? dejavu_text(app::demo_scene())
                               : load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "studies" / (name + ".yaml"));
  const YAML::Node own_seed = value_at(scene, "simulate.look.seed");
  const int first_seed = own_seed.IsDefined() ? own_seed.as<int>() : 1;
  return changed(scene, {{"simulate.look.seed", YAML::Node(first_seed + kSeedStep * seed)}});
}

Sequence reference_sequence(const std::string& name) {
  const char* reference = std::getenv("PALPATE_REFERENCE_DATA");
  const std::filesystem::path folder = std::filesystem::path(reference ? reference : "") / name;
  if (!reference || !std::filesystem::exists(folder / "truth.csv"))
    throw BadInput(fmt::format("{}: reference data missing (set PALPATE_REFERENCE_DATA), left out", name));
  return {name, load_scene(folder / "scene.yaml"), folder / "truth.csv"};
}

}  // namespace palpate
