#include <fmt/format.h>

#include "palpate/core/errors.h"
#include "palpate/elastic/material.h"

namespace palpate {

namespace {

struct Preset {
  std::string name;
  double young_modulus_kPa;
  double poisson_ratio;
  std::string source;
};

const std::vector<Preset>& presets() {
  static const std::vector<Preset> kPresets = {
      {"liver", 27, 0.45, "Haouchine et al. 2018, section VII.A"},
      {"uterus", 400, 0.35, "Haouchine et al. 2018, section VII.B"},
      {"liver-elastography", 5.5, 0.45, "Roulot et al. 2008, healthy adults, transient elastography"},
      {"kidney-cortex", 15.4, 0.45, "Grenier et al. 2013, shear-wave elastography"},
  };
  return kPresets;
}

std::string preset_list() {
  std::string text;
  for (const Preset& preset : presets())
    text += fmt::format("{}{} ({} kPa, {}; {})", text.empty() ? "" : "; ", preset.name, preset.young_modulus_kPa,
                        preset.poisson_ratio, preset.source);
  return text;
}

constexpr double kModulusWhereUnknown_kPa = 1;

/// Of the modulus of confined compression (material.h).
constexpr double kBarrierRatio = 0.05;

void fill_from_preset(TissueOptions& tissue) {
  if (tissue.preset.empty()) {
    if (tissue.modulus_unknown) tissue.young_modulus_kPa = kModulusWhereUnknown_kPa;
    if (tissue.young_modulus_kPa <= 0)
      throw BadInput("tissue needs young_modulus_kPa (and poisson_ratio), or a preset");
    return;
  }
  std::vector<std::string> names;
  for (const Preset& preset : presets()) {
    names.push_back(preset.name);
    if (preset.name != tissue.preset) continue;
    if (tissue.young_modulus_kPa > 0)
      throw BadInput("tissue has both preset and young_modulus_kPa, expected one of them");
    tissue.young_modulus_kPa = tissue.modulus_unknown ? kModulusWhereUnknown_kPa : preset.young_modulus_kPa;
    tissue.poisson_ratio = preset.poisson_ratio;
    tissue.preset.clear();
    return;
  }
  throw BadInput(fmt::format("tissue.preset is '{}', expected one of: {}", tissue.preset, fmt::join(names, ", ")));
}

}  // namespace

void describe(Settings& settings, TissueOptions& options) {
  settings.choice("law", options.law, law_words(),
                  "elastic law; neo-hookean is the one to use for pushing, saint-venant-kirchhoff-barrier only keeps "
                  "elements from turning inside out there; linear holds for small motions only");
  settings.number_or_word("young_modulus_kPa", options.young_modulus_kPa, {0, 1e8, true, false}, "unknown",
                          options.modulus_unknown,
                          "Young's modulus E; the force is proportional to it. unknown: forces are N per kPa of E, and "
                          "every row warns modulus_unknown (palpate modulus finds E from one measured contact)");
  settings.number("poisson_ratio", options.poisson_ratio, {0, 0.5, false, true}, "Poisson's ratio nu");
  settings.text("preset", options.preset, "instead of the two numbers: " + preset_list());
  settings.after_reading([&options] { fill_from_preset(options); });
}

const std::vector<std::pair<std::string, Law>>& law_words() {
  static const std::vector<std::pair<std::string, Law>> kWords = {
      {"saint-venant-kirchhoff", Law::saint_venant_kirchhoff},
      {"saint-venant-kirchhoff-barrier", Law::saint_venant_kirchhoff_barrier},
      {"neo-hookean", Law::neo_hookean},
      {"corotated", Law::corotated},
      {"linear", Law::linear}};
  return kWords;
}

std::string law_name(Law law) {
  for (const auto& word : law_words())
    if (word.second == law) return word.first;
  return {};
}

std::string force_unit(const TissueOptions& tissue) {
  return tissue.modulus_unknown ? "N/kPa" : "N";
}

std::string stress_unit(const TissueOptions& tissue) {
  return tissue.modulus_unknown ? "of E" : "kPa";
}

std::string modulus_text(const TissueOptions& tissue) {
  return tissue.modulus_unknown ? "unknown" : fmt::format("{:g} kPa", tissue.young_modulus_kPa);
}

Lame lame_of(const TissueOptions& tissue) {
  const double E = tissue.young_modulus_MPa(), nu = tissue.poisson_ratio;
  const double lambda = E * nu / ((1 + nu) * (1 - 2 * nu)), mu = E / (2 * (1 + nu));
  return {lambda, mu, kBarrierRatio * (lambda + 2 * mu)};
}

Lame lame_of(const TissueOptions& tissue, int label) {
  if (label <= 0 || label > static_cast<int>(tissue.of_label.size())) return lame_of(tissue);
  const Stiffness& stiffness = tissue.of_label[static_cast<size_t>(label) - 1];
  TissueOptions labelled;
  labelled.young_modulus_kPa = stiffness.young_modulus_kPa;
  labelled.poisson_ratio = stiffness.poisson_ratio;
  return lame_of(labelled);
}

}  // namespace palpate
