#include "palpate/session/run.h"

#include <fmt/format.h>

#include "palpate/core/errors.h"
#include "palpate/session/clear_results.h"
#include "palpate/session/in_scene.h"
#include "palpate/session/playback.h"
#include "palpate/session/root_folder.h"
#include "palpate/session/shape.h"
#include "palpate/stream/stream_hub.h"

namespace palpate {

namespace {

StreamHub make_streams(const SceneFile& scene_file, const BuiltMap& built) {
  const Scene& scene = scene_file.scene;
  return in_scene(scene_file, "streams", [&] {
    const StreamScene live = stream_scene(built.map, built.rectification.rig, built.fps, scene.contact.friction);
    return StreamHub(scene_file.streams, live, scene.instrument);
  });
}

}  // namespace

ForceEstimator make_estimator(const SceneFile& scene_file, const BuiltMap& built, const StreamHub* streams) {
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

struct Run::State {
  State(const SceneFile& s, const BuiltMap& built, const std::filesystem::path& folder, Truths truths,
        const RunControl& options, std::shared_ptr<Recording> live)
      : scene_file(s),
        stopped(options.stopped),
        streams(make_streams(s, built)),
        estimator(make_estimator(s, built, &streams)),
        recording(live ? std::move(live) : std::make_shared<Recording>(s.scene.recording)),
        playback(*recording, options.realtime, options.stopped) {
    recording->count_anew();
    begin_results(folder, sources_of(scene_file));
    files.emplace(s, folder, built, *recording, std::move(truths), streams);
    files->losses.attempt([&] { write_map_files(built, folder); });
    keep_shape([&] { shapes.emplace(folder / "shapes.bin", built); });
  }

  std::optional<RunFrame> next() {
    std::optional<PlayedFrame> played = playback.next();
    if (!played) return std::nullopt;
    last = played->frame;
    RunFrame shown = files->add(*played, answer_to(*played));
    if (shapes) keep_shape([&] { shapes->write(shown.estimate); });
    return shown;
  }

  /// Shapes are for looking at: a run goes on without.
  template <class Work>
  void keep_shape(const Work& work) {
    try {
      work();
    } catch (const Unfinished&) {
      shapes.reset();
    }
  }

  ForceEstimate answer_to(const PlayedFrame& played) {
    if (played.passed_over) return not_looked_at(played.frame, "frame_passed_over");
    const bool shows_nothing = played.frame.left.empty() && played.frame.right.empty();
    return shows_nothing ? not_looked_at(played.frame, "source_lost") : estimator->update(played.frame);
  }

  const SceneFile& scene_file;
  std::function<bool()> stopped;
  StreamHub streams;
  std::optional<ForceEstimator> estimator;
  std::shared_ptr<Recording> recording;
  Playback playback;
  std::optional<RunFiles> files;
  std::optional<ShapeWriter> shapes;
  StereoFrame last;
  bool over = false;
};

Run::Run(const SceneFile& scene_file, const BuiltMap& built, const std::filesystem::path& folder, Truths truths,
         const RunControl& options, std::shared_ptr<Recording> live)
    : state_(std::make_unique<State>(scene_file, built, folder, std::move(truths), options, std::move(live))) {}

Run::~Run() = default;

std::optional<RunFrame> Run::next() {
  State& s = *state_;
  if (s.over) return std::nullopt;
  std::optional<RunFrame> shown;
  try {
    s.files->losses.attempt([&] { shown = s.next(); });
  } catch (const BadInput& reason) {  // an image in the middle that does not open
    s.files->losses.add(reason.what());
  }
  s.over = !shown;
  if (shown && s.stopped()) {
    s.over = true;
    if (!s.recording->is_live()) s.files->losses.add(fmt::format("interrupted after frame {}", shown->estimate.frame));
  }
  return shown;
}

void Run::take_map(const BuiltMap& built) {
  ForceEstimator estimator = make_estimator(state_->scene_file, built, &state_->streams);
  state_->estimator.emplace(std::move(estimator));
}

void Run::close() {
  state_->files->dropped = dropped();
  state_->files->close();
}

int Run::dropped() const {
  return state_->recording->dropped();
}

int Run::frame_count() const {
  return state_->recording->frame_count();
}

std::vector<std::string> Run::damages() const {
  return state_->recording->damages();
}

const RunFiles& Run::files() const {
  return *state_->files;
}

const StreamHub& Run::streams() const {
  return state_->streams;
}

const StereoFrame& Run::last_frame() const {
  return state_->last;
}

}  // namespace palpate
