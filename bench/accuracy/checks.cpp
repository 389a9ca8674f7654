#include "bench/accuracy/checks.h"

#include <fmt/format.h>

#include <fstream>
#include <random>

#include "palpate/core/errors.h"
#include "palpate/feedback/forces_file.h"

namespace palpate {
namespace {

using Changes = std::vector<SceneChange>;
using Told = std::function<Changes(const Sequence&, const std::filesystem::path&)>;

constexpr double kTipBias_mm = 0.3, kTipNoise_mm = 0.03;
constexpr double kThicknessRatio = 0.2, kAttachments_mm = 5;

YAML::Node yaml(const std::string& text) {
  return YAML::Load(text);
}

Changes nothing(const Sequence&, const std::filesystem::path&) {
  return {};
}

/// A number of the scene times a factor.
Told scaled(const std::string& key, double factor) {
  return [key, factor](const Sequence& sequence, const std::filesystem::path&) -> Changes {
    return {{key, YAML::Node(factor * value_at(sequence.scene, key).as<double>())}};
  };
}

/// The true tip with an offset along the optical axis and noise, as a track.
Told biased_tip(double bias_mm) {
  return [bias_mm](const Sequence& sequence, const std::filesystem::path& folder) -> Changes {
    std::filesystem::create_directories(folder);
    const std::filesystem::path track = std::filesystem::absolute(folder / "tip.csv");
    std::ofstream stream(track);
    stream << "frame,time_s,x_mm,y_mm,z_mm\n";
    std::mt19937 bits(1);
    const auto noise_mm = [&bits] {
      double sum = 0;  // of twelve uniforms: near enough to normal
      for (int i = 0; i < 12; ++i) sum += static_cast<double>(bits()) * 0x1.0p-32;
      return kTipNoise_mm * (sum - 6);
    };
    for (const ForceRow& row : read_truth(sequence.truth)) {
      const Vec3 tip_mm = row.tip_mm + Vec3(noise_mm(), noise_mm(), noise_mm() + bias_mm);
      stream << fmt::format("{},{},{},{},{}\n", row.frame, row.time_s, tip_mm.x(), tip_mm.y(), tip_mm.z());
    }
    if (!stream.flush()) throw Unfinished(track.string() + ": cannot be written");
    return {{"instrument.track", YAML::Node(track.string())}};
  };
}

/// Every attachment nearer to the camera: as if the body were held that much higher.
Changes attachments_off(const Sequence& sequence, const std::filesystem::path&) {
  YAML::Node regions = YAML::Clone(value_at(sequence.scene, "attachments"));
  for (YAML::Node region : regions)
    for (auto kind : region) {
      YAML::Node values = kind.second;
      if (values["depth_mm"]) values["depth_mm"] = values["depth_mm"].as<double>() + kAttachments_mm;
      for (const char* corner : {"min_mm", "max_mm", "center_mm"})
        if (values[corner]) values[corner][2] = values[corner][2].as<double>() - kAttachments_mm;
    }
  return {{"attachments", regions}};
}

const char* const kBreathing = "{motion_mm: [0.5, 2.0, 2.2], period_s: 4, instrument: stands}";
const char* const kHeartbeat = "{motion_mm: [0.3, 0.5, 0.8], period_s: 0.83}";
const char* const kStretch = "{strain: [0.02, 0.02, 0], period_s: 4}";
const char* const kPan = "{by_mm: [5, 0, 0], from_s: 0.4, during_s: 2.4}";
const char* const kTouchDown = "{from_s: 0.4, to_s: 0.8}";  // they touch at 0.6 s

}  // namespace

std::string Goal::text() const {
  if (no_worse_than_tip) return "no worse than tip, or flagged";
  std::string text = median_pct == worst_pct ? fmt::format("<= {:g}", worst_pct)
                                             : fmt::format("median <= {:g}, worst <= {:g}", median_pct, worst_pct);
  if (shape) text += ", gain 0.95-1.05, <= 5 deg";
  if (between) text += ", between <= 3";
  return text;
}

std::vector<Check> all_checks() {
  const std::vector<std::string> all = static_sequences();
  const std::vector<std::string> moving = {"uterus", "liver_slab", "heart", "liver_push"};
  const Goal at_rest{5, 8, true, false, false}, in_motion{7, 7, false, true, false}, told_wrong{7, 7},
      body_wrong{0, 0, false, false, true};
  return {
      {"static", "nothing moves, everything told right", all, {}, nothing, at_rest},
      {"radius_half", "footprint radius told at half", all, {}, scaled("contact.footprint_radius_mm", 0.5), told_wrong},
      {"radius_twice", "footprint radius told at twice", all, {}, scaled("contact.footprint_radius_mm", 2), told_wrong},
      {"breathing",
       "breathes by 3 mm at 0.25 Hz beneath a hand that stands",
       moving,
       {{"simulate.breathing", yaml(kBreathing)}},
       nothing,
       in_motion},
      {"heart", "1 mm at 1.2 Hz", moving, {{"simulate.heart", yaml(kHeartbeat)}}, nothing, in_motion},
      {"affine", "attachments strained by 2 %", moving, {{"simulate.stretch", yaml(kStretch)}}, nothing, in_motion},
      {"pan", "the camera pans by 5 mm", moving, {{"simulate.camera.pan", yaml(kPan)}}, nothing, in_motion},
      {"hidden",
       "tip covered for 10 frames around the touch-down",
       moving,
       {{"simulate.obscured", yaml(kTouchDown)}},
       nothing,
       told_wrong},
      {"tip_near", "tip track 0.3 mm too near to the camera", all, {}, biased_tip(-kTipBias_mm), told_wrong},
      {"tip_far", "tip track 0.3 mm too far from the camera", all, {}, biased_tip(kTipBias_mm), told_wrong},
      {"thin", "thickness told 20 % too small", all, {}, scaled("map.thickness_mm", 1 - kThicknessRatio), body_wrong},
      {"thick", "thickness told 20 % too large", all, {}, scaled("map.thickness_mm", 1 + kThicknessRatio), body_wrong},
      {"attachments", "attachments 5 mm too near to the camera", all, {}, attachments_off, body_wrong},
  };
}

Goal goal_of(const Check& check, const std::string& sequence) {
  Goal goal = check.goal;
  // The truth of its push is up to 8 % high.
  if (sequence == "rendered_uterus" && goal.shape) goal.median_pct = goal.worst_pct = 8;
  return goal;
}

}  // namespace palpate
