#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "palpate/session/session.h"

namespace palpate {

/// What a viewer says: {"id": 3, "ask": "edit", ...} for a command, {"view": {"picture": true, "shape": false}} for
/// what it wants to be sent, {"ping": 12.5} for an answer at once.
struct ViewerMessage {
  int64_t id = 0;
  std::optional<Command> command;
  std::optional<bool> wants_picture, wants_shape;
  std::optional<double> ping;
};

/// Throws BadInput with a sentence: no JSON, unknown or missing field, wrong kind of value.
ViewerMessage parse_viewer_message(const std::string& text);

/// {"reply": id, "error": sentence}; no error where the command was obeyed.
std::string reply_json(int64_t id, const std::string& sentence);
std::string pong_json(double ping);

/// What one viewer has been told already; a new viewer nothing.
struct ToldSoFar {
  bool nothing = true;
  std::filesystem::path scene_file;
  std::string scene_text;
  bool is_saved = false, can_undo = false, can_redo = false;
  std::shared_ptr<const SourceView> source;
  std::shared_ptr<const BuiltMap> map;
  bool map_is_stale = false;
  std::shared_ptr<const RowLog> log;
  size_t rows = 0;
};

/// The state as JSON: phase, stages and run; scene, source and map where they have changed since `told`; the rows that
/// are new, at most some hundred of them (`has_more` then).
std::string state_json(const Snapshot& snapshot, const RootFolder& root, ToldSoFar& told, bool& has_more);

}  // namespace palpate
