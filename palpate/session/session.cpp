#include "palpate/session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/core/source_kind.h"
#include "palpate/core/whole_file.h"
#include "palpate/session/run.h"
#include "palpate/session/run_folder.h"
#include "palpate/session/scene_text.h"
#include "palpate/session/source_view.h"

namespace palpate {

namespace {

constexpr size_t kMaxEditsKept = 500;
/// A live source is shown as often where nothing runs.
constexpr auto kBetweenLooks = std::chrono::milliseconds(250);

bool is_passed_over(const ForceEstimate& estimate) {
  return std::find(estimate.warnings.begin(), estimate.warnings.end(), "frame_passed_over") != estimate.warnings.end();
}

std::string text_of_file(const std::filesystem::path& file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a YAML scene file", file.string(), obstacle));
  return read_whole_file(file);
}

}  // namespace

std::string phase_name(Phase phase) {
  switch (phase) {
    case Phase::idle:
      return "idle";
    case Phase::ready:
      return "ready";
    case Phase::building:
      return "building";
    case Phase::running:
      return "running";
    case Phase::failed:
      return "failed";
  }
  return {};
}

/// All but the queue, the flags and the published snapshot belongs to the session's thread.
struct Session::State {
  struct Asked {
    Command command;
    std::function<void(const std::string&)> done;
  };

  RootFolder root;
  std::function<void()> on_change;

  std::mutex mutex;
  std::condition_variable woken;
  std::deque<Asked> queue;
  bool ended = false;
  std::atomic<bool> stop{false};
  mutable std::mutex published_mutex;
  SharedSnapshot published;

  Snapshot now;
  std::vector<std::string> undo, redo;
  std::string saved_text, built_text;
  std::vector<std::string> trusted;
  std::shared_ptr<Recording> live;  ///< nothing where the scene's source is none
  std::unique_ptr<LiveRecorder> recorder;
  uint64_t pictures = 0;
  std::shared_ptr<const SceneFile> run_scene;
  std::vector<std::shared_ptr<const BuiltMap>> run_maps;  ///< outlive the run that was begun with them
  std::unique_ptr<Run> run;
  std::shared_ptr<RowLog> rows;
  std::thread thread;

  State(RootFolder r, std::function<void()> c, bool may_open_live) : root(std::move(r)), on_change(std::move(c)) {
    now.may_open_live = may_open_live;
    published = std::make_shared<const Snapshot>(now);
  }

  void publish() {
    ++now.version;
    now.is_saved = now.scene_text == saved_text;
    now.can_undo = !undo.empty();
    now.can_redo = !redo.empty();
    now.map_is_stale = now.map && now.scene_text != built_text;
    if (recorder) now.kept = recorder->view();
    auto next = std::make_shared<const Snapshot>(now);
    {
      const std::lock_guard lock(published_mutex);
      published = std::move(next);
    }
    if (on_change) on_change();
  }

  void require_scene() const {
    if (!now.source) throw BadInput("no recording is open, expected a scene or a recording first");
  }
  void require_no_run() const {
    if (run) throw BadInput("a run goes on, expected it to end first");
  }

  /// A scene with its source; nothing has changed where it throws.
  void take_scene(const std::string& text, const std::filesystem::path& file, bool is_trusted) {
    const SceneFile scene = read_scene_text(text, file);
    if (is_trusted)
      trusted = sources_of(scene);
    else
      root.require_holds_all(scene, trusted, now.may_open_live);
    const std::string before = now.source ? recording_text(now.scene) : "";
    if (before != recording_text(scene) || file != now.scene_file) {
      if (recorder) throw BadInput("the video of the live source is being recorded, expected that to end first");
      live.reset();  // a camera can be opened once only
      take_source(scene, std::max(0, scene.scene.map.frame));
    }
    now.scene = scene;
    now.scene_text = text;
    now.scene_file = file;
  }

  void take_source(const SceneFile& scene, int frame) {
    const std::shared_ptr<Recording> recording = live ? live : open_recording(scene);
    auto view = std::make_shared<SourceView>(view_source(scene, *recording, frame));
    view->number = ++pictures;
    now.source = std::move(view);
    live = recording->is_live() ? recording : nullptr;
  }

  bool is_live() const { return now.source && now.source->timing.is_live; }

  /// From its beginning; a live one as it is.
  std::shared_ptr<Recording> opened() {
    if (live) return live;
    std::shared_ptr<Recording> recording = open_recording(now.scene);
    if (recording->is_live()) live = recording;
    return recording;
  }

  void open(const std::filesystem::path& file, const std::string& text, bool is_saved, bool is_trusted) {
    require_no_run();
    take_scene(text, file, is_trusted);
    undo.clear();
    redo.clear();
    saved_text = is_saved ? text : "";
    now.map.reset();
    now.stages.clear();
    now.run.reset();
  }

  void obey(const ask::OpenScene& asked) {
    const std::filesystem::path file = root.inside(asked.file);
    open(file, text_of_file(file), true, false);
  }

  void obey(const ask::OpenRecording& asked) {
    const std::string& first = asked.stereo.empty() ? asked.left : asked.stereo;
    const auto is_file = [](const std::string& name) { return kind_of_source(name) == SourceKind::file; };
    const std::filesystem::path folder = root.inside(is_file(first) ? first : asked.calibration).parent_path();
    const auto relative = [&](const std::string& name) {
      return name.empty() || !is_file(name) ? name : root.inside(name).lexically_relative(folder).string();
    };
    const std::string text = new_scene_text(relative(asked.left), relative(asked.right), relative(asked.stereo),
                                            relative(asked.calibration));
    open(free_file(folder, "scene", ".yaml"), text, false, false);
  }

  void obey(const ask::Look& asked) {
    require_scene();
    require_no_run();
    take_source(now.scene, asked.frame);
  }

  void obey(const ask::Edit& asked) {
    require_scene();
    require_no_run();
    const std::string before = now.scene_text, after = with_changes(before, asked.changes);
    if (after == before) return;
    take_scene(after, now.scene_file, false);
    undo.push_back(before);
    if (undo.size() > kMaxEditsKept) undo.erase(undo.begin());
    redo.clear();
  }

  void step(std::vector<std::string>& from, std::vector<std::string>& to) {
    require_no_run();
    if (from.empty()) return;
    const std::string before = now.scene_text;
    take_scene(from.back(), now.scene_file, false);
    from.pop_back();
    to.push_back(before);
  }
  void obey(const ask::Undo&) { step(undo, redo); }
  void obey(const ask::Redo&) { step(redo, undo); }

  void obey(const ask::Save& asked) {
    require_scene();
    std::filesystem::path file = now.scene_file;
    if (!asked.name.empty()) {
      if (asked.name.find('/') != std::string::npos || !(asked.name.ends_with(".yaml") || asked.name.ends_with(".yml")))
        throw BadInput(fmt::format("'{}' is no name for a scene, expected NAME.yaml", asked.name));
      file = now.scene_file.parent_path() / asked.name;
    }
    if (!root.holds(file)) throw BadInput(fmt::format("{} is outside of {}", file.string(), root.path().string()));
    write_whole_file(file, now.scene_text);
    now.scene_file = now.scene.file = file;
    saved_text = now.scene_text;
  }

  /// Publishes each stage as it begins; `begun` is when the last one did.
  OnStage watch_stages(int64_t& begun) {
    now.phase = Phase::building;
    now.sentence.clear();
    now.stages = {{"read", 0}};
    publish();
    return [this, &begun](const std::string& stage) {
      if (stop) throw Unfinished("the build was stopped");
      end_stage(begun);
      now.stages.push_back({stage, 0});
      publish();
    };
  }
  void end_stage(int64_t& begun) {
    const int64_t at = steady_ns();
    if (!now.stages.empty()) now.stages.back().ms += static_cast<double>(at - begun) * 1e-6;
    begun = at;
  }

  void obey(const ask::Build&) {
    require_scene();
    require_no_run();
    stop = false;
    int64_t begun = steady_ns();
    BuildWatch watch;
    watch.on_stage = watch_stages(begun);
    auto built = std::make_shared<const BuiltMap>(build_map(now.scene, *opened(), watch));
    end_stage(begun);
    now.map = std::move(built);
    ++now.map_number;
    built_text = now.scene_text;
  }

  void obey(const ask::Start& asked) {
    require_scene();
    require_no_run();
    if (!now.map) throw BadInput("there is no map yet, expected it to be built first");
    if (now.scene_text != built_text)
      throw BadInput("the scene has changed since its map was built, expected it to be built again");
    stop = false;
    RunView view;
    view.folder = free_file(root.path() / "runs", now.scene_file.stem().string(), "");
    run_scene = std::make_shared<const SceneFile>(now.scene);
    run_maps = {now.map};
    run = std::make_unique<Run>(*run_scene, *now.map, view.folder, Truths{},
                                RunControl{asked.realtime, [this] { return stop.load(); }},
                                is_live() ? opened() : nullptr);
    view.frame_count = run->frame_count();
    view.rows = rows = std::make_shared<RowLog>();
    now.run = std::move(view);
    now.phase = Phase::running;
  }

  void obey(const ask::Stop&) { stop = true; }

  void obey(const ask::Mark& asked) {
    if (!now.run || !now.run->shown) throw BadInput("nothing runs that could be marked");
    const ForceEstimate& at = now.run->shown->estimate;
    now.run->marks.push_back({at.frame, at.time_s, asked.text.empty() ? "mark" : asked.text});
    write_marks(*now.run);
  }

  void obey(const ask::Rest&) {
    if (!run || !now.run->shown) throw BadInput("nothing runs whose present frame could be the state at rest");
    int64_t begun = steady_ns();
    auto built =
        std::make_shared<const BuiltMap>(build_map_again(*run_scene, *now.map, run->last_frame(), watch_stages(begun)));
    end_stage(begun);
    run->take_map(*built);
    run_maps.push_back(built);
    now.map = std::move(built);
    ++now.map_number;
    obey(ask::Mark{"map built again from this frame"});
  }

  void obey(const ask::Record& asked) {
    require_scene();
    if (!asked.on) {
      if (recorder) now.kept = recorder->close();
      recorder.reset();
      return;
    }
    if (!is_live()) throw BadInput("the source is a recording already, expected a live one");
    if (recorder) throw BadInput("the video is being recorded already");
    const bool is_map_of_scene = now.map && now.scene_text == built_text;
    recorder =
        std::make_unique<LiveRecorder>(opened(), now.scene, now.scene_text, is_map_of_scene ? now.map.get() : nullptr,
                                       free_file(root.path() / "recordings", now.scene_file.stem().string(), ""));
  }

  /// Where a command leads back to, whether it was obeyed or not.
  Phase phase_at_rest() const { return run ? Phase::running : now.source ? Phase::ready : Phase::idle; }

  void obey(const Asked& asked) {
    std::string sentence;
    try {
      std::visit([this](const auto& command) { obey(command); }, asked.command);
    } catch (const std::exception& error) {
      sentence = error.what();
    }
    // An edit or a recording that is refused is told to who asked, and is no failure of the session.
    const bool is_aside =
        std::holds_alternative<ask::Edit>(asked.command) || std::holds_alternative<ask::Record>(asked.command);
    const bool fails = !sentence.empty() && !is_aside;
    if (fails || sentence.empty()) {
      now.phase = fails && !run ? Phase::failed : phase_at_rest();
      now.sentence = fails ? sentence : "";
    }
    publish();
    if (asked.done) asked.done(sentence);
  }

  void step_run() {
    std::optional<RunFrame> frame = run->next();
    now.run->dropped = run->dropped();
    if (frame) {
      const ForceEstimate& estimate = frame->estimate;
      rows->add(run->files().rows.back());
      if (is_passed_over(estimate)) {
        // It tells nothing: what is shown stays until a frame has been looked at.
        ++now.run->passed_over;
        return publish();
      }
      now.run->shown = std::make_shared<const RunFrame>(std::move(*frame));
      now.run->shown_ns = steady_ns();
      publish();
      return;
    }
    end_run();
    publish();
  }

  /// The live source as it is at this moment.
  void look() {
    const std::optional<StereoFrame> frame = live->next();
    if (!frame) {
      live.reset();
      return;
    }
    auto view = std::make_shared<SourceView>(*now.source);
    view->is_silent = frame->left.empty();
    if (!view->is_silent) {
      view->frame = *frame;
      view->pair = frame->right.empty() ? RectifiedPair{} : rectify(view->rectification, *frame);
      view->number = ++pictures;
    }
    now.source = std::move(view);
    publish();
  }

  void end_run() {
    run->close();
    now.run->over = true;
    now.run->end = run->files().losses.text();
    run.reset();
    run_maps.clear();
    now.phase = phase_at_rest();
  }

  void work() {
    pthread_setname_np(pthread_self(), "palpate-session");
    while (true) {
      std::optional<Asked> asked;
      {
        std::unique_lock lock(mutex);
        const auto is_asked = [this] { return ended || !queue.empty(); };
        if (!run && live)
          woken.wait_for(lock, kBetweenLooks, is_asked);
        else if (!run)
          woken.wait(lock, is_asked);
        if (ended) break;
        if (!queue.empty()) {
          asked = std::move(queue.front());
          queue.pop_front();
        }
      }
      if (asked)
        obey(*asked);
      else if (run)
        step_run();
      else if (live)
        look();
    }
    if (run) end_run();
    recorder.reset();
  }
};

Session::Session(RootFolder root, std::function<void()> on_change, bool may_open_live)
    : state_(std::make_unique<State>(std::move(root), std::move(on_change), may_open_live)) {
  state_->thread = std::thread([this] { state_->work(); });
}

Session::~Session() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ended = state_->stop = true;
  }
  state_->woken.notify_one();
  state_->thread.join();
}

void Session::open_trusted(const std::filesystem::path& scene) {
  // Nothing has been asked yet, so the thread sleeps.
  const std::filesystem::path file = std::filesystem::absolute(scene).lexically_normal();
  state_->open(file, text_of_file(file), true, true);
  state_->now.phase = Phase::ready;
  state_->publish();
}

void Session::ask(Command command, std::function<void(const std::string& sentence)> done) {
  {
    const std::lock_guard lock(state_->mutex);
    if (std::holds_alternative<ask::Stop>(command)) state_->stop = true;
    state_->queue.push_back({std::move(command), std::move(done)});
  }
  state_->woken.notify_one();
}

SharedSnapshot Session::newest() const {
  const std::lock_guard lock(state_->published_mutex);
  return state_->published;
}

const RootFolder& Session::root() const {
  return state_->root;
}

}  // namespace palpate
