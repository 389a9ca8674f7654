#include "app/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/progress.h"
#include "app/runtime.h"
#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/core/stopwatch.h"
#include "palpate/feedback/warnings.h"
#include "palpate/session/output_folder.h"
#include "palpate/session/run.h"

namespace palpate::app {

namespace {

FrameTimes median_stages(const std::vector<FrameTimes>& all) {
  FrameTimes medians;
  for (double FrameTimes::*stage : {&FrameTimes::rectify_ms, &FrameTimes::track_ms, &FrameTimes::contact_ms,
                                    &FrameTimes::solve_ms, &FrameTimes::stress_ms, &FrameTimes::draw_ms}) {
    std::vector<double> of_stage;
    for (const FrameTimes& times : all) of_stage.push_back(times.*stage);
    medians.*stage = quantile_of(of_stage, 0.5);
  }
  return medians;
}

RunSummary summary_of(const RunFiles& files, double map_s) {
  RunSummary summary;
  summary.folder = files.folder;
  summary.tissue = files.scene_file.scene.tissue;
  summary.frames = static_cast<int>(files.rows.size());
  summary.elements = static_cast<int>(files.built.map.mesh.tetrahedra.size());
  summary.map_s = map_s;
  std::vector<double> frame_ms;
  for (const FrameTimes& times : files.times) frame_ms.push_back(times.total_ms());
  summary.median_frame_ms = quantile_of(frame_ms, 0.5);
  summary.p99_frame_ms = quantile_of(frame_ms, 0.99);
  summary.stages = median_stages(files.contact_times.empty() ? files.times : files.contact_times);
  for (const ForceRow& row : files.rows) {
    summary.peak_force_N = std::max(summary.peak_force_N, row.force_magnitude_N);
    ++summary.frames_by_status[row.status];
  }
  summary.peak_force_per_modulus_N_per_kPa = peak_per_modulus(files.rows, summary.tissue);
  summary.frames_by_warning = count_warnings(files.rows);
  if (!files.truths.first.empty()) summary.comparison = compare(files.rows, files.truths.first);
  for (const ForceRow& row : files.forces_2.rows())
    summary.peak_force_2_N = std::max(summary.peak_force_2_N.value_or(0), row.force_magnitude_N);
  if (!files.truths.second.empty() && summary.peak_force_2_N)
    summary.comparison_2 = compare(files.forces_2.rows(), files.truths.second);
  return summary;
}

std::string text_line(const std::string& name, const std::string& value) {
  return fmt::format("{:<22}{}\n", name, value);
}

std::string text_of_comparison(const Comparison& c) {
  std::string text;
  const auto line = [&text](const std::string& name, const std::string& value) { text += text_line(name, value); };
  line("true peak force", fmt::format("{:.2f} N", c.true_peak_N));
  line("force RMSE", fmt::format("{:.3f} N", c.force_rmse_N));
  if (c.force_nrmse_pct) line("force NRMSE", fmt::format("{:.1f} % of the true peak", *c.force_nrmse_pct));
  if (c.direction_error_deg_median)
    line("direction error", fmt::format("{:.1f} degrees median", *c.direction_error_deg_median));
  if (c.onset_error_frames) line("onset error", fmt::format("{:+d} frames", *c.onset_error_frames));
  if (c.release_error_frames) line("release error", fmt::format("{:+d} frames", *c.release_error_frames));
  line("false contact", fmt::format("{} frames", c.false_contact_frames));
  if (c.tip_rmse_mm) line("tip RMSE", fmt::format("{:.2f} mm", *c.tip_rmse_mm));
  return text;
}

}  // namespace

BuildWatch watch_of_terminal(bool quiet) {
  BuildWatch watch;
  if (!quiet)
    watch.told = [](const std::string& what, const std::string& sentence) {
      fmt::print(stderr, "{:<12}{}\n", what, sentence);
    };
  return watch;
}

BuiltMap build_map(const SceneFile& scene_file, bool quiet) {
  return palpate::build_map(scene_file, *open_recording(scene_file), watch_of_terminal(quiet));
}

std::vector<ForceRow> estimate_rows(const SceneFile& scene_file, bool quiet) {
  const BuiltMap built = build_map(scene_file, quiet);
  ForceEstimator estimator = make_estimator(scene_file, built);
  Recording recording(scene_file.scene.recording);
  Progress progress("estimate", quiet);
  std::vector<ForceRow> rows;
  while (auto frame = recording.next()) {
    rows.push_back(to_row(estimator.update(*frame)));
    progress.show(frame->index + 1, recording.frame_count());
    if (!interrupted()) continue;
    if (recording.is_live()) break;
    throw Unfinished(fmt::format("interrupted after frame {}", frame->index));
  }
  return rows;
}

RunSummary run_estimate(const SceneFile& scene_file, const RunOptions& options) {
  require_output_folder(options.folder);
  Truths truths = read_truths(options.truth);
  Stopwatch watch;
  const std::shared_ptr<Recording> recording = open_recording(scene_file);
  const BuiltMap built = palpate::build_map(scene_file, *recording, watch_of_terminal(options.quiet));
  const bool is_live = recording->is_live();
  const double map_s = watch.lap_ms() / 1000;
  if (!options.quiet)
    fmt::print(stderr, "map         {} tetrahedra, {} attached nodes, {} points, {:.2f} s\n",
               built.map.mesh.tetrahedra.size(), built.map.fixed_nodes.size(), built.map.cloud.size(), map_s);

  Run run(scene_file, built, options.folder, std::move(truths), {options.realtime, [] { return interrupted().load(); }},
          is_live ? recording : nullptr);
  if (is_live && !options.quiet) fmt::print(stderr, "live        Ctrl-C ends it and keeps what is done\n");
  if (!options.quiet)
    for (const std::string& note : run.streams().notes()) fmt::print(stderr, "streams     {}\n", note);
  {
    Progress progress("estimate", options.quiet);
    const std::string unit = force_unit(scene_file.scene.tissue);
    while (const auto shown = run.next()) {
      const ForceEstimate& estimate = shown->estimate;
      progress.show(estimate.frame + 1, run.frame_count(),
                    fmt::format("{} {:.3g} {}", status_name(estimate.status), estimate.force_N.norm(), unit));
    }
  }
  run.close();
  if (!options.quiet)
    for (const std::string& damage : run.damages()) fmt::print(stderr, "warning     {}\n", damage);
  const RunFiles& files = run.files();
  if (files.losses.any())
    throw Unfinished(
        fmt::format("{}; {} frames are kept in {}", files.losses.text(), files.rows.size(), options.folder.string()));
  RunSummary summary = summary_of(files, map_s);
  if (is_live) summary.dropped = files.dropped;
  summary.streams = run.streams().summary();
  return summary;
}

std::string to_text(const RunSummary& summary) {
  std::string text;
  const auto line = [&text](const std::string& name, const std::string& value) { text += text_line(name, value); };
  std::string statuses;
  for (const auto& [status, count] : summary.frames_by_status)
    statuses += fmt::format("{}{} {}", statuses.empty() ? "" : ", ", count, status);
  line("frames", fmt::format("{} ({})", summary.frames, statuses));
  if (summary.dropped)
    line("dropped", fmt::format("{} frames, a newer one was looked at in their place", *summary.dropped));
  line("map", fmt::format("{} tetrahedra in {:.2f} s", summary.elements, summary.map_s));
  line("time per frame",
       fmt::format("{:.1f} ms median, {:.1f} ms for 99 %", summary.median_frame_ms, summary.p99_frame_ms));
  const TissueOptions& tissue = summary.tissue;
  line("tissue assumed", fmt::format("{}, E {} {}, nu = {:g}", law_name(tissue.law),
                                     tissue.modulus_unknown ? "is" : "=", modulus_text(tissue), tissue.poisson_ratio));
  const Vec3& ratios = summary.peak_force_per_modulus_N_per_kPa;
  const std::string ratio =
      fmt::format("{:.3g} N per kPa of E (95 %: {:.3g} to {:.3g})", ratios[0], ratios[1], ratios[2]);
  line("peak force", tissue.modulus_unknown ? ratio : fmt::format("{:.2f} N, that is {}", summary.peak_force_N, ratio));
  if (summary.frames_by_status.count("tool_lost") && summary.frames_by_status.size() == 1)
    line("instrument", "not seen in any frame");
  for (const auto& [name, frames] : summary.frames_by_warning)
    line("warning", fmt::format("{} frames: {} ({})", frames, warning_words(name), name));
  if (summary.peak_force_2_N)
    line("second instrument", fmt::format("peak force {:.2f} N, forces_2.csv", *summary.peak_force_2_N));
  for (const std::string& stream : summary.streams) line("streams", stream);
  if (summary.comparison) text += text_of_comparison(*summary.comparison);
  if (summary.comparison_2) text += "second instrument:\n" + text_of_comparison(*summary.comparison_2);
  line("written to", summary.folder.string());
  return text;
}

nlohmann::ordered_json to_json(const RunSummary& summary) {
  nlohmann::ordered_json json;
  json["folder"] = summary.folder.string();
  json["frames"] = summary.frames;
  json["frames_by_status"] = summary.frames_by_status;
  json["frames_by_warning"] = summary.frames_by_warning;
  if (summary.dropped) json["dropped_frames"] = *summary.dropped;
  json["elements"] = summary.elements;
  json["map_s"] = summary.map_s;
  json["median_frame_ms"] = summary.median_frame_ms;
  json["p99_frame_ms"] = summary.p99_frame_ms;
  json["frames_per_second"] = summary.median_frame_ms > 0 ? 1000 / summary.median_frame_ms : 0;
  json["stage_track_ms"] = summary.stages.track_ms;
  json["stage_solve_ms"] = summary.stages.solve_ms;
  json["stage_stress_ms"] = summary.stages.stress_ms;
  json["stage_draw_ms"] = summary.stages.draw_ms;
  json["tissue"] = tissue_json(summary.tissue);
  json["peak_force_N"] = summary.peak_force_N;
  json["peak_force_per_modulus_N_per_kPa"] = summary.peak_force_per_modulus_N_per_kPa[0];
  json["peak_force_per_modulus_low_N_per_kPa"] = summary.peak_force_per_modulus_N_per_kPa[1];
  json["peak_force_per_modulus_high_N_per_kPa"] = summary.peak_force_per_modulus_N_per_kPa[2];
  if (summary.peak_force_2_N) json["peak_force_2_N"] = *summary.peak_force_2_N;
  if (!summary.streams.empty()) json["streams"] = summary.streams;
  if (summary.comparison) json["comparison"] = nlohmann::ordered_json::parse(palpate::to_json(*summary.comparison));
  if (summary.comparison_2)
    json["comparison_2"] = nlohmann::ordered_json::parse(palpate::to_json(*summary.comparison_2));
  return json;
}

}  // namespace palpate::app
