#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "palpate/session/root_folder.h"
#include "palpate/session/snapshot.h"
#include "palpate/session/yaml_edit.h"

namespace palpate {

/// What a session can be asked for. Names of files are relative to its root.
namespace ask {
struct OpenScene {
  std::string file;
};
/// A scene of its own, around a recording: left and right, or stereo alone.
/// The names may be those of live sources; the scene stands beside the calibration then.
struct OpenRecording {
  std::string left, right, stereo, calibration;
};
/// Looks at another frame of the source.
struct Look {
  int frame = 0;
};
struct Edit {
  std::vector<YamlChange> changes;
};
struct Undo {};
struct Redo {};
/// Into the folder of the scene; empty = as it is named.
struct Save {
  std::string name;
};
struct Build {};
struct Start {
  bool realtime = true;
};
/// Ends a run, or a build at its next stage.
struct Stop {};
struct Mark {
  std::string text;
};
/// The frame that a run has come to is the state at rest: the map is built again from it, and the run goes on.
struct Rest {};
/// Begins or ends to keep the video of a live source.
struct Record {
  bool on = true;
};
}  // namespace ask

using Command = std::variant<ask::OpenScene, ask::OpenRecording, ask::Look, ask::Edit, ask::Undo, ask::Redo, ask::Save,
                             ask::Build, ask::Start, ask::Stop, ask::Mark, ask::Rest, ask::Record>;

/// Source, scene, map, estimator and results as one state machine, on a thread of its own: commands go in, snapshots
/// come out. It never waits for who looks at it; the newest snapshot wins. A live source is open as long as its scene.
class Session {
 public:
  /// `on_change` is called from the session's thread after each new snapshot and must not wait. `may_open_live`:
  /// devices, pipelines and addresses too.
  Session(RootFolder root, std::function<void()> on_change, bool may_open_live = false);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// A scene that the operator names at the start: what it reads may lie outside of the root. Throws BadInput.
  void open_trusted(const std::filesystem::path& scene);

  /// Commands are obeyed one after the other; `done` is told, from the session's thread, why one could not be (empty =
  /// it was).
  void ask(Command command, std::function<void(const std::string& sentence)> done = {});

  SharedSnapshot newest() const;
  const RootFolder& root() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
