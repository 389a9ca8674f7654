#include "palpate/session/live_recorder.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <condition_variable>
#include <deque>
#include <fstream>
#include <mutex>
#include <optional>
#include <thread>

#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"
#include "palpate/feedback/video_writer.h"
#include "palpate/session/yaml_edit.h"
#include "palpate/stereo/write_rig.h"

namespace palpate {

namespace {

constexpr size_t kMaxWaiting = 50;
/// Tissue is measured in these pictures: finer than a video to look at.
constexpr int kQuality_crf = 14;

using Path = std::vector<std::string>;

/// Names of files, as seen from another folder.
void collect_files(const YAML::Node& node, const Path& path, const std::filesystem::path& from,
                   const std::filesystem::path& to, std::vector<YamlChange>& changes) {
  const auto deeper = [&](const YAML::Node& child, const std::string& name) {
    Path below = path;
    below.push_back(name);
    collect_files(child, below, from, to, changes);
  };
  if (node.IsMap())
    for (const auto& pair : node) deeper(pair.second, pair.first.Scalar());
  if (node.IsSequence())
    for (size_t i = 0; i < node.size(); ++i) deeper(node[i], std::to_string(i));
  if (!node.IsScalar()) return;
  const std::filesystem::path named = node.Scalar();
  std::error_code error;
  if (named.is_absolute() || named.extension().empty() || !std::filesystem::is_regular_file(from / named, error))
    return;
  const std::filesystem::path seen = std::filesystem::proximate(from / named, to, error);
  changes.push_back({path, fmt::format("\"{}\"", seen.string())});
}

}  // namespace

std::string kept_scene_text(const std::string& scene_text, const std::filesystem::path& scene_folder,
                            const std::filesystem::path& folder, bool begins_with_map) {
  std::vector<YamlChange> changes = {
      {{"recording"}, "{left: left.mp4, right: right.mp4, calibration: calibration.yaml}"}};
  const YAML::Node scene = YAML::Load(scene_text);
  for (const auto& pair : scene)
    if (pair.first.Scalar() != "recording")
      collect_files(pair.second, {pair.first.Scalar()}, scene_folder, folder, changes);
  if (begins_with_map) {
    changes.push_back({{"map", "frame"}, "0"});
    if (scene["map"] && scene["map"]["frames"]) changes.push_back({{"map", "frames"}, ""});
  }
  return with_changes(scene_text, changes);
}

struct LiveRecorder::State {
  std::shared_ptr<Recording> live;
  std::optional<VideoWriter> left, right;
  std::ofstream times;
  std::optional<double> origin_s;  ///< time of the steady clock that is 0 in the files
  double lead_s = 0;               ///< by which the first live frame comes after the map's

  mutable std::mutex mutex;
  std::condition_variable woken;
  std::deque<StereoFrame> waiting;
  KeptView kept;
  bool ends = false;
  std::thread writer;

  void write(const StereoFrame& frame, double time_s) {
    int number = 0;
    {
      const std::lock_guard lock(mutex);
      number = kept.frames;
    }
    left->write(frame.left, time_s);
    if (!frame.right.empty()) right->write(frame.right, time_s);
    times << fmt::format("{},{:.6f},{}\n", number, time_s, frame.right.empty() ? 0 : 1) << std::flush;
    const std::lock_guard lock(mutex);
    ++kept.frames;
    kept.seconds = time_s;
  }

  void take(const StereoFrame& frame) {
    if (frame.left.empty()) return;
    const std::lock_guard lock(mutex);
    if (waiting.size() < kMaxWaiting && !ends)
      waiting.push_back(frame);
    else
      ++kept.left_out;
    woken.notify_one();
  }

  void work() {
    pthread_setname_np(pthread_self(), "palpate-keep");
    try {
      while (true) {
        StereoFrame frame;
        {
          std::unique_lock lock(mutex);
          woken.wait(lock, [this] { return ends || !waiting.empty(); });
          if (waiting.empty()) break;
          frame = std::move(waiting.front());
          waiting.pop_front();
        }
        if (!origin_s) origin_s = frame.time_s - lead_s;
        write(frame, frame.time_s - *origin_s);
      }
      left->finish();
      right->finish();
    } catch (const Unfinished& reason) {
      const std::lock_guard lock(mutex);
      kept.end = reason.what();
      ends = kept.over = true;
      waiting.clear();
    }
  }
};

LiveRecorder::LiveRecorder(std::shared_ptr<Recording> live, const SceneFile& scene, const std::string& scene_text,
                           const BuiltMap* map, const std::filesystem::path& folder)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.live = std::move(live);
  s.kept.folder = folder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Unfinished(fmt::format("{} cannot be made: {}", folder.string(), error.message()));
  write_rig(folder / "calibration.yaml", read_rig(scene.scene.recording), s.live->size());
  write_whole_file(folder / "scene.yaml",
                   kept_scene_text(scene_text, std::filesystem::absolute(scene.file).parent_path(), folder, map));
  s.left.emplace(folder / "left.mp4", s.live->fps(), s.live->size(), kQuality_crf);
  s.right.emplace(folder / "right.mp4", s.live->fps(), s.live->size(), kQuality_crf);
  s.times.open(folder / "times.csv");
  s.times << "frame,time_s,has_right\n";
  if (map) {
    s.write(map->frame, 0);
    s.lead_s = 1 / s.live->fps();
  }
  s.writer = std::thread([&s] { s.work(); });
  s.live->listen([&s](const StereoFrame& frame) { s.take(frame); });
}

LiveRecorder::~LiveRecorder() {
  close();
}

KeptView LiveRecorder::view() const {
  const std::lock_guard lock(state_->mutex);
  return state_->kept;
}

KeptView LiveRecorder::close() {
  State& s = *state_;
  s.live->listen({});
  {
    const std::lock_guard lock(s.mutex);
    s.ends = true;
  }
  s.woken.notify_one();
  if (s.writer.joinable()) s.writer.join();
  const std::lock_guard lock(s.mutex);
  s.kept.over = true;
  return s.kept;
}

}  // namespace palpate
