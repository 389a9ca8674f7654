#include "palpate/session/built_map.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "palpate/core/errors.h"
#include "palpate/core/mesh_files.h"
#include "palpate/core/whole_file.h"
#include "palpate/feedback/map_confidence.h"
#include "palpate/feedback/map_json.h"
#include "palpate/feedback/map_preview.h"
#include "palpate/instrument/tip_track.h"
#include "palpate/session/in_scene.h"
#include "palpate/session/losses.h"
#include "palpate/volume/body_remarks.h"

namespace palpate {

namespace {

/// Outlines may run along the border of the image, not mostly outside.
constexpr double kMinFractionInImage = 0.5;
constexpr double kBlack_levels = 40, kLongestDarkness_s = 10;

/// A region drawn in a picture of another size selects the wrong tissue, or none.
void require_region_in_image(const std::vector<cv::Point2d>& region_px, cv::Size size) {
  if (region_px.empty()) return;
  const std::vector<cv::Point2f> corners(region_px.begin(), region_px.end());
  const cv::Rect2f around = cv::boundingRect(corners), image({0, 0}, cv::Size2f(size));
  if ((around & image).area() >= kMinFractionInImage * around.area()) return;
  throw BadInput(fmt::format(
      "map.organ_region_px reaches from ({:g}, {:g}) to ({:g}, {:g}), expected corners inside the left image of {}x{} "
      "px",
      around.tl().x, around.tl().y, around.br().x - 1, around.br().y - 1, size.width, size.height));
}

/// Cameras that are switched on begin with black pictures.
bool shows_something(const StereoFrame& frame) {
  return !frame.left.empty() && !frame.right.empty() && cv::norm(frame.left, cv::NORM_INF) > kBlack_levels &&
         cv::norm(frame.right, cv::NORM_INF) > kBlack_levels;
}

/// " (the next one is frame 3)", where there is one.
std::string next_with_both(Recording& recording) {
  while (const std::optional<StereoFrame> frame = recording.next())
    if (!frame->left.empty() && !frame->right.empty()) return fmt::format(" (the next one is frame {})", frame->index);
  return {};
}

/// The frames that the map is built from, the last of them its static frame. Throws BadInput.
std::vector<StereoFrame> static_frames(Recording& recording, const MapOptions& options) {
  std::optional<StereoFrame> frame = recording.next();
  std::vector<StereoFrame> frames;
  const double begun_s = frame ? frame->time_s : 0;
  const auto is_too_early = [&] {
    return frame->index < options.frame || (recording.is_live() && !shows_something(*frame));
  };
  while (frame && is_too_early()) {
    if (recording.is_live() && frame->time_s - begun_s > kLongestDarkness_s)
      throw BadInput(
          fmt::format("recording: live, but within {} s there was no frame in which both cameras show "
                      "something",
                      kLongestDarkness_s));
    if (frame->index >= options.first_frame() && !frame->right.empty()) frames.push_back(*frame);
    frame = recording.next();
  }
  if (!frame)
    throw BadInput(
        fmt::format("map.frame is {}, but the recording has only {} frames", options.frame, recording.frame_count()));
  if (frame->right.empty())
    throw BadInput(fmt::format(
        "map.frame is {}, but the right camera shows nothing of that time, expected a frame that both have{}",
        options.frame, next_with_both(recording)));
  frames.push_back(*frame);
  if (recording.is_live())
    for (StereoFrame& taken : frames) taken.index = -1;
  return frames;
}

}  // namespace

std::string sentence_in_scene(const SceneFile& scene_file, const std::string& key, const std::string& sentence) {
  const auto names = [&sentence](const char* group) { return sentence.starts_with(group); };
  const bool names_key = names("recording") || names("map.") || names("attachments") || names("instrument") ||
                         names("contact.") || names("uncertainty") || names("streams");
  const std::filesystem::path& volume = scene_file.scene.map.volume;
  const std::string told = names_key                                                  ? ""
                           : !volume.empty() && sentence.starts_with(volume.string()) ? "map.volume: "
                                                                                      : key + ": ";
  return fmt::format("{}: {}{}", scene_file.file.string(), told, sentence);
}

std::shared_ptr<Recording> open_recording(const SceneFile& scene_file) {
  return in_scene(scene_file, "recording", [&] { return std::make_shared<Recording>(scene_file.scene.recording); });
}

BuiltMap build_map(const SceneFile& scene_file, Recording& recording, const BuildWatch& watch) {
  const Scene& scene = scene_file.scene;
  const auto opened = [&](const std::string& key, const auto& stage) { return in_scene(scene_file, key, stage); };
  const StereoRig rig = opened("recording.calibration", [&] {
    StereoRig read = read_rig(scene.recording);
    check_rig_fits(read, recording.size());
    return read;
  });
  if (!scene.instrument.track.empty() && !scene.instrument.has_live_track())
    opened("instrument.track", [&] { return read_tip_track(scene.instrument.track); });
  watch.told("calibration", describe_rig(rig, recording.size()));
  BuiltMap built;
  built.timing = recording.timing();
  built.notes = recording.notes();
  built.notes.insert(built.notes.end(), rig.notes.begin(), rig.notes.end());
  if (!scene.map.volume.empty()) {
    const auto remarks = opened("map.volume", [&] { return body_remarks(scene.map.volume); });
    built.notes.insert(built.notes.end(), remarks.begin(), remarks.end());
  }
  watch.told("recording", describe_timing(built.timing));
  for (const std::string& note : built.notes) watch.told("note", note);
  built.fps = recording.fps();
  built.frame_count = recording.frame_count();
  built.rectification = make_rectification(rig, recording.size());
  opened("map", [&] {
    require_region_in_image(scene.map.organ_region_px, recording.size());
    const std::vector<StereoFrame> frames = static_frames(recording, scene.map);
    built.frame = frames.back();
    built.map =
        build_tissue_map(frames, built.rectification, scene.map, scene.tissue, scene.attachments, watch.on_stage);
  });
  for (const std::string& warning : built.map.disparity.warnings) watch.told("warning", warning);
  return built;
}

BuiltMap build_map_again(const SceneFile& scene_file, const BuiltMap& before, const StereoFrame& frame,
                         const OnStage& on_stage) {
  const Scene& scene = scene_file.scene;
  BuiltMap built = before;
  built.frame = frame;
  in_scene(scene_file, "map", [&] {
    if (frame.right.empty()) throw BadInput("the right camera shows nothing, expected a frame that both have");
    built.map = build_tissue_map(std::vector<StereoFrame>{frame}, built.rectification, scene.map, scene.tissue,
                                 scene.attachments, on_stage);
  });
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

}  // namespace palpate
