#include "palpate/session/run_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "palpate/core/stopwatch.h"
#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

constexpr int kReportPictures = 6, kEvery_frames = 25;
constexpr size_t kMaxKept = 64;

std::string run_yaml(SceneFile scene_file, const Rectification& rectification, const std::vector<ForceRow>& rows,
                     int dropped) {
  scene_file.dropped_frames = dropped;
  scene_file.peak_force_per_modulus_N_per_kPa = peak_per_modulus(rows, scene_file.scene.tissue);
  scene_file.has_run = scene_file.scene.has_tuning = true;
  scene_file.rectified_from_left = rectification.rectified_from_left;
  return fmt::format("# every setting in effect; palpate {}\n{}", PALPATE_VERSION, write_scene_file(scene_file));
}

std::string caption(const ForceEstimate& estimate, const std::string& unit) {
  const std::string force = estimate.in_contact ? fmt::format(", {:.3g} {}", estimate.force_N.norm(), unit) : "";
  return fmt::format("frame {}, {:.2f} s, {}{}", estimate.frame, estimate.time_s, status_name(estimate.status), force);
}

}  // namespace

Truths read_truths(const std::filesystem::path& truth) {
  if (truth.empty()) return {};
  Truths truths{read_truth(truth), {}};
  std::filesystem::path second = truth;
  second.replace_filename(truth.stem().string() + "_2" + truth.extension().string());
  if (std::filesystem::exists(second)) truths.second = read_truth(second);
  return truths;
}

Vec3 peak_per_modulus(const std::vector<ForceRow>& rows, const TissueOptions& tissue) {
  const auto peak = std::max_element(rows.begin(), rows.end(), [](const ForceRow& a, const ForceRow& b) {
    return a.force_magnitude_N < b.force_magnitude_N;
  });
  if (peak == rows.end() || !(peak->force_magnitude_N > 0)) return Vec3::Zero();
  return Vec3(peak->force_magnitude_N, peak->force_low_N, peak->force_high_N) / tissue.young_modulus_kPa;
}

PictureChoice::PictureChoice(int frames, std::string unit)
    : every_(frames < 0 ? kEvery_frames : std::max(1, frames / (2 * kReportPictures))), unit_(std::move(unit)) {}

void PictureChoice::offer(const cv::Mat& overlay, const ForceEstimate& estimate) {
  if (estimate.frame % every_ != 0) return;
  if (pictures_.size() >= kMaxKept) {
    every_ *= 2;
    for (size_t i = 0; 2 * i < pictures_.size(); ++i) pictures_[i] = std::move(pictures_[2 * i]);
    pictures_.resize(pictures_.size() / 2);
  }
  pictures_.push_back({estimate.force_N.norm(), {overlay.clone(), caption(estimate, unit_)}});
}

std::vector<ReportPicture> PictureChoice::chosen() const {
  std::vector<size_t> order(pictures_.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [this](size_t a, size_t b) { return pictures_[a].force_N > pictures_[b].force_N; });
  order.resize(std::min<size_t>(order.size(), kReportPictures));
  std::sort(order.begin(), order.end());
  std::vector<ReportPicture> result;
  for (size_t i : order) result.push_back(pictures_[i].picture);
  return result;
}

RunFiles::RunFiles(const SceneFile& s, const std::filesystem::path& f, const BuiltMap& b, const Recording& recording,
                   Truths t, StreamHub& hub)
    : scene_file(s),
      folder(f),
      built(b),
      truths(std::move(t)),
      forces(f / "forces.csv"),
      forces_2(f / "forces_2.csv"),
      painter(b.rectification, s.scene.tissue, s.overlay),
      pictures(recording.frame_count(), force_unit(s.scene.tissue)),
      streams(hub) {
  losses.attempt([&] { write_whole_file(folder / "run.yaml", run_yaml(scene_file, built.rectification, {}, 0)); });
  losses.attempt([&] { overlay.emplace(folder / "overlay.mp4", recording.fps(), recording.size()); });
}

RunFrame RunFiles::add(const PlayedFrame& played, ForceEstimate estimate) {
  Stopwatch watch;
  // A source that is silent shows nothing, not what it showed last.
  const cv::Mat& left = played.frame.left;
  const cv::Mat picture =
      painter.paint(left.empty() ? cv::Mat::zeros(built.rectification.size, CV_8UC3) : left, estimate);
  estimate.times.draw_ms = watch.lap_ms();
  for (ForceEstimate& other : estimate.further) other.times = estimate.times;
  if (!played.passed_over) streams.publish(estimate, picture, played.decoded_ns);
  // First the picture: whenever the program dies, each row has its own.
  if (overlay && !losses.attempt([&] { overlay->write(picture); })) overlay.reset();
  forces.write(estimate);
  forces_2.write(estimate);
  pictures.offer(picture, estimate);
  rows.push_back(to_row(estimate));
  const bool shows_nothing = left.empty() && played.frame.right.empty();
  if (!played.passed_over && !shows_nothing) times.push_back(estimate.times);
  if (estimate.in_contact) contact_times.push_back(estimate.times);
  return {std::move(estimate), picture, played.taken_ns, played.decoded_ns};
}

void RunFiles::close() {
  if (overlay) losses.attempt([&] { overlay->finish(); });
  Report report;
  report.title = std::filesystem::weakly_canonical(folder).filename().string();
  report.rows = rows;
  report.rows_2 = forces_2.rows();
  report.truth = truths.first;
  report.truth_2 = truths.second;
  // Frames are matched by number; a truth may count its time from elsewhere, or name none.
  for (std::vector<ForceRow>* truth : {&report.truth, &report.truth_2})
    for (ForceRow& row : *truth) row.time_s = row.frame / built.fps;
  report.times = times;
  report.tissue = scene_file.scene.tissue;
  report.settings = run_yaml(scene_file, built.rectification, rows, dropped);
  report.pictures = pictures.chosen();
  losses.attempt([&] { write_whole_file(folder / "run.yaml", report.settings); });
  losses.attempt([&] { write_report(folder / "report.html", report); });
}

}  // namespace palpate
