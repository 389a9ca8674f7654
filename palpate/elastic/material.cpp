#include "palpate/elastic/material.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "palpate/core/errors.h"

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

void fill_from_preset(TissueOptions& tissue) {
  if (tissue.preset.empty()) {
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
    tissue.young_modulus_kPa = preset.young_modulus_kPa;
    tissue.poisson_ratio = preset.poisson_ratio;
    tissue.preset.clear();
    return;
  }
  throw BadInput(fmt::format("tissue.preset is '{}', expected one of: {}", tissue.preset, fmt::join(names, ", ")));
}

const std::vector<std::pair<std::string, Law>>& law_words() {
  static const std::vector<std::pair<std::string, Law>> kWords = {
      {"saint-venant-kirchhoff", Law::saint_venant_kirchhoff}, {"neo-hookean", Law::neo_hookean}};
  return kWords;
}

Mat9 saint_venant_kirchhoff_derivative(const Lame& lame, const Mat3& F) {
  const Mat3 E = 0.5 * (F.transpose() * F - Mat3::Identity());
  const Mat3 S = lame.lambda * E.trace() * Mat3::Identity() + 2 * lame.mu * E;
  const Mat3 FFt = F * F.transpose();
  Mat9 C;
  for (int l = 0; l < 3; ++l)
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
          C(i + 3 * j, k + 3 * l) = (i == k ? S(j, l) : 0) + lame.lambda * F(i, j) * F(k, l) +
                                    lame.mu * (F(i, l) * F(k, j) + (j == l ? FFt(i, k) : 0));
  return C;
}

Mat9 neo_hookean_derivative(const Lame& lame, const Mat3& F) {
  const double J = F.determinant();
  const Mat3 G = F.inverse().transpose();
  const double I1 = F.squaredNorm(), kappa = bulk_modulus(lame);
  const double mu_j = lame.mu * std::pow(std::abs(J), -2.0 / 3.0);
  Mat9 C;
  for (int l = 0; l < 3; ++l)
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
          C(i + 3 * j, k + 3 * l) =
              mu_j * ((i == k && j == l ? 1 : 0) - 2.0 / 3.0 * (G(k, l) * F(i, j) + F(k, l) * G(i, j)) +
                      2.0 / 9.0 * I1 * G(i, j) * G(k, l) + I1 / 3.0 * G(i, l) * G(k, j)) +
              kappa * ((2 * J - 1) * J * G(i, j) * G(k, l) - (J - 1) * J * G(i, l) * G(k, j));
  return C;
}

}  // namespace

void describe(Settings& settings, TissueOptions& options) {
  settings.choice("law", options.law, law_words(), "elastic law; neo-hookean is the one to use for pushing");
  settings.number("young_modulus_kPa", options.young_modulus_kPa, {0, 1e8, true, false},
                  "Young's modulus E; the force is proportional to it");
  settings.number("poisson_ratio", options.poisson_ratio, {0, 0.5, false, true}, "Poisson's ratio nu");
  settings.text("preset", options.preset, "instead of the two numbers: " + preset_list());
  settings.after_reading([&options] { fill_from_preset(options); });
}

std::string law_name(Law law) {
  for (const auto& word : law_words())
    if (word.second == law) return word.first;
  return {};
}

Lame lame_of(const TissueOptions& tissue) {
  const double E = tissue.young_modulus_MPa(), nu = tissue.poisson_ratio;
  return {E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))};
}

double energy_density(Law law, const Lame& lame, const Mat3& F) {
  if (law == Law::saint_venant_kirchhoff) {
    const Mat3 E = 0.5 * (F.transpose() * F - Mat3::Identity());
    return 0.5 * lame.lambda * E.trace() * E.trace() + lame.mu * E.squaredNorm();
  }
  const double J = F.determinant();
  if (J <= 0) return std::numeric_limits<double>::infinity();
  return 0.5 * lame.mu * (std::pow(J, -2.0 / 3.0) * F.squaredNorm() - 3) + 0.5 * bulk_modulus(lame) * (J - 1) * (J - 1);
}

Mat3 first_piola_stress(Law law, const Lame& lame, const Mat3& F) {
  if (law == Law::saint_venant_kirchhoff) {
    const Mat3 E = 0.5 * (F.transpose() * F - Mat3::Identity());
    return F * (lame.lambda * E.trace() * Mat3::Identity() + 2 * lame.mu * E);
  }
  const double J = F.determinant();
  const Mat3 G = F.inverse().transpose();
  return lame.mu * std::pow(std::abs(J), -2.0 / 3.0) * (F - F.squaredNorm() / 3.0 * G) +
         bulk_modulus(lame) * (J - 1) * J * G;
}

Mat9 stress_derivative(Law law, const Lame& lame, const Mat3& F) {
  return law == Law::saint_venant_kirchhoff ? saint_venant_kirchhoff_derivative(lame, F)
                                            : neo_hookean_derivative(lame, F);
}

double bulk_modulus(const Lame& lame) {
  return lame.lambda + 2.0 / 3.0 * lame.mu;
}

Lame without_bulk(const Lame& lame) {
  return {-2.0 / 3.0 * lame.mu, lame.mu};
}

double volume_ratio(Law law, const Mat3& F) {
  return law == Law::saint_venant_kirchhoff ? 0.5 * (F.squaredNorm() - 1) : F.determinant();
}

Mat3 volume_ratio_gradient(Law law, const Mat3& F) {
  if (law == Law::saint_venant_kirchhoff) return F;
  Mat3 cofactor;
  for (int j = 0; j < 3; ++j) cofactor.col(j) = F.col((j + 1) % 3).cross(F.col((j + 2) % 3));
  return cofactor;
}

Mat9 volume_ratio_curvature(Law law, const Mat3& F) {
  if (law == Law::saint_venant_kirchhoff) return Mat9::Identity();
  // Block (j, l) is the matrix of the cross product with the third column, up to sign.
  Mat9 C = Mat9::Zero();
  for (int j = 0; j < 3; ++j) {
    const int next = (j + 1) % 3, last = (j + 2) % 3;
    Mat3 cross;
    cross << 0, -F(2, last), F(1, last), F(2, last), 0, -F(0, last), -F(1, last), F(0, last), 0;
    C.block<3, 3>(3 * j, 3 * next) = -cross;
    C.block<3, 3>(3 * next, 3 * j) = cross;
  }
  return C;
}

Mat3 cauchy_stress(Law law, const Lame& lame, const Mat3& F) {
  return first_piola_stress(law, lame, F) * F.transpose() / F.determinant();
}

double von_mises(const Mat3& s) {
  const double xy = s(0, 0) - s(1, 1), yz = s(1, 1) - s(2, 2), zx = s(2, 2) - s(0, 0);
  const double shear = s(0, 1) * s(0, 1) + s(1, 2) * s(1, 2) + s(2, 0) * s(2, 0);
  return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx + 6 * shear));
}

}  // namespace palpate
