#include "palpate/console/replay.h"

#include <fmt/format.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/videoio.hpp>

#include "palpate/console/pictures.h"
#include "palpate/console/row_json.h"
#include "palpate/core/table.h"
#include "palpate/core/whole_file.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/session/shape.h"

namespace palpate {

namespace {

using nlohmann::ordered_json;

constexpr int kDeepest = 4;
constexpr size_t kMaxRuns = 500;
/// A jump further ahead than this is quicker than reading on.
constexpr int kReadOn_frames = 60;

/// The video that was asked for last, where it stands.
struct OpenVideo {
  std::filesystem::path file;
  std::filesystem::file_time_type written;
  cv::VideoCapture capture;
  int next = 0;
};

cv::Mat picture_at(OpenVideo& video, int frame) {
  if (frame < video.next || frame > video.next + kReadOn_frames) {
    video.capture.set(cv::CAP_PROP_POS_FRAMES, frame);
    video.next = frame;
  }
  cv::Mat picture;
  while (video.next <= frame && video.capture.grab()) ++video.next;
  if (video.next > frame) video.capture.retrieve(picture);
  return picture;
}

}  // namespace

Answer list_runs(const RootFolder& root) {
  ordered_json runs = ordered_json::array();
  std::error_code error;
  auto at = std::filesystem::recursive_directory_iterator(
      root.path(), std::filesystem::directory_options::skip_permission_denied, error);
  for (; !error && at != std::filesystem::recursive_directory_iterator(); at.increment(error)) {
    if (at.depth() >= kDeepest || at->path().filename().string().starts_with('.')) at.disable_recursion_pending();
    if (at->path().filename() != "forces.csv" || !std::filesystem::exists(at->path().parent_path() / "run.yaml"))
      continue;
    const auto written = std::filesystem::last_write_time(at->path()).time_since_epoch().count();
    runs.push_back({{"folder", root.name_of(at->path().parent_path())}, {"written", written}});
    if (runs.size() >= kMaxRuns) break;
  }
  std::sort(runs.begin(), runs.end(),
            [](const ordered_json& a, const ordered_json& b) { return a["written"] > b["written"]; });
  return {200, "application/json",
          ordered_json{{"runs", runs}}.dump(-1, ' ', false, ordered_json::error_handler_t::replace)};
}

Answer replay_rows(const std::filesystem::path& folder) {
  ordered_json json;
  json["rows"] = ordered_json::array();
  for (const ForceRow& row : read_forces(folder / "forces.csv")) json["rows"].push_back(row_json(row));
  json["shapes"] = ordered_json::array();
  for (const ShapePlace& place : shape_places(folder / "shapes.bin")) json["shapes"].push_back(place.frame);
  json["has_report"] = std::filesystem::exists(folder / "report.html");
  json["has_video"] = std::filesystem::exists(folder / "overlay.mp4");
  json["marks"] = read_whole_file(folder / "marks.csv");
  return {200, "application/json", json.dump(-1, ' ', false, ordered_json::error_handler_t::replace)};
}

Answer replay_picture(const std::filesystem::path& folder, int frame) {
  static std::mutex mutex;
  static OpenVideo video;
  const std::lock_guard lock(mutex);
  const std::filesystem::path file = folder / "overlay.mp4";
  std::error_code error;
  const auto written = std::filesystem::last_write_time(file, error);
  if (error) return {404, "text/plain; charset=utf-8", "that run has no video"};
  if (video.file != file || video.written != written) {
    video.capture.release();
    video = {file, written, cv::VideoCapture(file.string(), cv::CAP_FFMPEG), 0};
  }
  const cv::Mat picture = picture_at(video, frame);
  if (picture.empty()) return {404, "text/plain; charset=utf-8", fmt::format("the video has no frame {}", frame)};
  return {200, "image/jpeg", jpeg_of(picture)};
}

Answer replay_shape(const std::filesystem::path& folder, int frame) {
  const std::filesystem::path file = folder / "shapes.bin";
  const std::vector<ShapePlace> places = shape_places(file);
  if (places.empty()) return {404, "text/plain; charset=utf-8", "that run kept no shapes"};
  const ShapePlace* newest = &places.front();
  for (const ShapePlace& place : places)
    if (place.frame <= frame) newest = &place;
  return {200, "application/octet-stream", read_shape(file, *newest)};
}

Answer replay_report(const std::filesystem::path& folder) {
  return {200, "text/html; charset=utf-8", read_whole_file(folder / "report.html")};
}

}  // namespace palpate
