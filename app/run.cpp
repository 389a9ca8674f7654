#include "app/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/answer.h"
#include "app/clear_results.h"
#include "app/output_folder.h"
#include "app/playback.h"
#include "app/progress.h"
#include "app/recording_check.h"
#include "app/run_files.h"
#include "app/runtime.h"
#include "palpate/core/errors.h"
#include "palpate/core/mesh_files.h"
#include "palpate/core/stopwatch.h"
#include "palpate/core/whole_file.h"
#include "palpate/estimate/force_estimator.h"
#include "palpate/feedback/map_confidence.h"
#include "palpate/feedback/map_json.h"
#include "palpate/feedback/map_preview.h"
#include "palpate/feedback/quantile.h"
#include "palpate/feedback/warnings.h"
#include "palpate/instrument/tip_track.h"
#include "palpate/stream/stream_hub.h"
#include "palpate/volume/body_remarks.h"

namespace palpate::app {

namespace {

/// Outlines may run along the border of the image, not mostly outside.
constexpr double kLeastShareInImage = 0.5;

/// Runs a stage that knows no scene file; what it finds bad is told with the file, and with `key` where its sentence
/// does not begin with one.
template <class Stage>
auto in_scene(const SceneFile& scene_file, const std::string& key, const Stage& stage) {
  try {
    return stage();
  } catch (const BadInput& error) {
    const std::string sentence = error.what();
    const auto names = [&sentence](const char* group) { return sentence.starts_with(group); };
    const bool names_key = names("recording") || names("map.") || names("attachments") || names("instrument") ||
                           names("contact.") || names("uncertainty") || names("streams");
    const std::filesystem::path& volume = scene_file.scene.map.volume;
    const std::string told = names_key                                                  ? ""
                             : !volume.empty() && sentence.starts_with(volume.string()) ? "map.volume: "
                                                                                        : key + ": ";
    throw BadInput(fmt::format("{}: {}{}", scene_file.file.string(), told, sentence));
  }
}

/// A region drawn in a picture of another size selects the wrong tissue, or none.
void require_region_in_image(const std::vector<cv::Point2d>& region_px, cv::Size size) {
  if (region_px.empty()) return;
  const std::vector<cv::Point2f> corners(region_px.begin(), region_px.end());
  const cv::Rect2f around = cv::boundingRect(corners), image({0, 0}, cv::Size2f(size));
  if ((around & image).area() >= kLeastShareInImage * around.area()) return;
  throw BadInput(fmt::format(
      "map.organ_region_px reaches from ({:g}, {:g}) to ({:g}, {:g}), expected corners inside the left image of {}x{} "
      "px",
      around.tl().x, around.tl().y, around.br().x - 1, around.br().y - 1, size.width, size.height));
}

FrameTimes median_stages(const std::vector<FrameTimes>& times, const std::vector<ForceRow>& rows) {
  const bool any_contact = std::any_of(rows.begin(), rows.end(), [](const ForceRow& row) { return row.in_contact; });
  FrameTimes medians;
  for (double FrameTimes::*stage : {&FrameTimes::rectify_ms, &FrameTimes::track_ms, &FrameTimes::contact_ms,
                                    &FrameTimes::solve_ms, &FrameTimes::stress_ms, &FrameTimes::draw_ms}) {
    std::vector<double> of_stage;
    for (size_t i = 0; i < times.size(); ++i)
      if (rows[i].in_contact || !any_contact) of_stage.push_back(times[i].*stage);
    medians.*stage = quantile(of_stage, 0.5);
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
  summary.median_frame_ms = quantile(frame_ms, 0.5);
  summary.p99_frame_ms = quantile(frame_ms, 0.99);
  summary.stages = median_stages(files.times, files.rows);
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

ForceEstimator make_estimator(const SceneFile& scene_file, const BuiltMap& built, const StreamHub* streams = nullptr) {
  const Scene& scene = scene_file.scene;
  InstrumentOptions instrument = scene.instrument;
  if (streams) instrument.live_tip = streams->live_tip();
  ForceUncertainty uncertainty = in_scene(scene_file, "uncertainty", [&] {
    return force_uncertainty(built.map, built.rectification, scene.map, scene.uncertainty,
                             scene.contact.footprint_radius_mm);
  });
  return in_scene(scene_file, "contact", [&] {
    return ForceEstimator(built.map, built.frame, built.rectification, instrument, scene.contact, scene.tuning,
                          std::move(uncertainty));
  });
}

}  // namespace

BuiltMap build_map(const SceneFile& scene_file, bool quiet) {
  const Scene& scene = scene_file.scene;
  const auto opened = [&](const std::string& key, const auto& stage) { return in_scene(scene_file, key, stage); };
  Recording recording = opened("recording", [&] { return Recording(scene.recording); });
  const StereoRig rig = opened("recording.calibration", [&] {
    StereoRig read = read_rig(scene.recording);
    check_rig_fits(read, recording.size());
    return read;
  });
  if (!scene.instrument.track.empty() && !scene.instrument.has_live_track())
    opened("instrument.track", [&] { return read_tip_track(scene.instrument.track); });
  if (!quiet) fmt::print(stderr, "calibration {}\n", describe_rig(rig, recording.size()));
  BuiltMap built;
  built.timing = recording.timing();
  built.notes = recording.notes();
  built.notes.insert(built.notes.end(), rig.notes.begin(), rig.notes.end());
  if (!scene.map.volume.empty()) {
    const auto remarks = opened("map.volume", [&] { return body_remarks(scene.map.volume); });
    built.notes.insert(built.notes.end(), remarks.begin(), remarks.end());
  }
  if (!quiet) fmt::print(stderr, "{}", describe_input(built.timing, built.notes));
  built.fps = recording.fps();
  built.frame_count = recording.frame_count();
  built.rectification = make_rectification(rig, recording.size());
  opened("map", [&] {
    require_region_in_image(scene.map.organ_region_px, recording.size());
    std::optional<StereoFrame> frame = recording.next();
    std::vector<StereoFrame> static_frames;
    while (frame && frame->index < scene.map.frame) {
      if (frame->index >= scene.map.first_frame() && !frame->right.empty()) static_frames.push_back(*frame);
      frame = recording.next();
    }
    if (!frame)
      throw BadInput(
          fmt::format("map.frame is {}, but the recording has only {} frames", scene.map.frame, built.frame_count));
    if (frame->right.empty())
      throw BadInput(
          fmt::format("map.frame is {}, but the right camera shows nothing of that time, expected a frame that "
                      "both have",
                      scene.map.frame));
    built.frame = *frame;
    static_frames.push_back(built.frame);
    built.map = build_tissue_map(static_frames, built.rectification, scene.map, scene.tissue, scene.attachments);
  });
  if (!quiet)
    for (const std::string& warning : built.map.disparity.warnings) fmt::print(stderr, "warning     {}\n", warning);
  return built;
}

void write_map_files(const BuiltMap& built, const std::filesystem::path& folder) {
  const TissueMap& map = built.map;
  MeshArrays arrays;
  arrays.node_scalars["fixed"].assign(map.mesh.nodes_mm.size(), 0.0);
  for (int node : map.fixed_nodes) arrays.node_scalars["fixed"][static_cast<size_t>(node)] = 1;
  Losses losses;
  losses.attempt([&] { write_vtu(folder / "map.vtu", map.mesh, arrays); });
  losses.attempt([&] { write_ply(folder / "surface.ply", map.surface); });
  losses.attempt([&] { write_ply(folder / "cloud.ply", map.cloud); });
  losses.attempt([&] { write_whole_file(folder / "map.json", map_json(map, built.rectification)); });
  const auto write_picture = [&](const std::string& name, const cv::Mat& picture) {
    losses.attempt([&] {
      std::vector<unsigned char> png;
      cv::imencode(".png", picture, png);
      write_whole_file(folder / name, {reinterpret_cast<const char*>(png.data()), png.size()});
    });
  };
  write_picture("preview.png", draw_map_preview(built.frame.left, built.rectification, map));
  write_picture("confidence.png", draw_map_confidence(built.frame.left, built.rectification, map));
  if (losses.any()) throw Unfinished(losses.text());
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
    if (interrupted()) throw Unfinished(fmt::format("interrupted after frame {}", frame->index));
  }
  return rows;
}

RunSummary run_estimate(const SceneFile& scene_file, const RunOptions& options) {
  require_output_folder(options.folder);
  Truths truths = read_truths(options.truth);
  Stopwatch watch;
  const BuiltMap built = build_map(scene_file, options.quiet);
  const double map_s = watch.lap_ms() / 1000;
  if (!options.quiet)
    fmt::print(stderr, "map         {} tetrahedra, {} attached nodes, {} points, {:.2f} s\n",
               built.map.mesh.tetrahedra.size(), built.map.fixed_nodes.size(), built.map.cloud.size(), map_s);

  const Scene& scene = scene_file.scene;
  StreamHub streams = in_scene(scene_file, "streams", [&] {
    const StreamScene live = stream_scene(built.map, built.rectification.rig, built.fps, scene.contact.friction);
    return StreamHub(scene_file.streams, live, scene.instrument);
  });
  if (!options.quiet)
    for (const std::string& note : streams.notes()) fmt::print(stderr, "streams     {}\n", note);
  ForceEstimator estimator = make_estimator(scene_file, built, &streams);
  Recording recording(scene.recording);
  Playback playback(recording, options.realtime);
  begin_results(options.folder);
  RunFiles files(scene_file, options.folder, built, recording, std::move(truths), streams);
  files.losses.attempt([&] { write_map_files(built, options.folder); });
  const auto loop = [&] {
    Progress progress("estimate", options.quiet);
    while (const auto played = playback.next()) {
      const ForceEstimate estimate = played->passed_over ? passed_over(played->frame) : estimator.update(played->frame);
      files.add(*played, estimate);
      progress.show(
          played->frame.index + 1, recording.frame_count(),
          fmt::format("{} {:.3g} {}", status_name(estimate.status), estimate.force_N.norm(), force_unit(scene.tissue)));
      if (interrupted()) throw Unfinished(fmt::format("interrupted after frame {}", played->frame.index));
    }
  };
  try {
    files.losses.attempt(loop);
  } catch (const BadInput& reason) {  // an image in the middle that does not open
    files.losses.add(reason.what());
  }
  files.close();
  if (files.losses.any())
    throw Unfinished(
        fmt::format("{}; {} frames are kept in {}", files.losses.text(), files.rows.size(), options.folder.string()));
  RunSummary summary = summary_of(files, map_s);
  summary.streams = streams.summary();
  return summary;
}

std::string to_text(const RunSummary& summary) {
  std::string text;
  const auto line = [&text](const std::string& name, const std::string& value) { text += text_line(name, value); };
  std::string statuses;
  for (const auto& [status, count] : summary.frames_by_status)
    statuses += fmt::format("{}{} {}", statuses.empty() ? "" : ", ", count, status);
  line("frames", fmt::format("{} ({})", summary.frames, statuses));
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
