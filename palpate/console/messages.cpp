#include "palpate/console/messages.h"

#include <fmt/format.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

using nlohmann::json;

constexpr size_t kMaxChanges = 100;
constexpr int kMaxDeep = 12;

json parse(const std::string& text) {
  int depth = 0;
  const auto not_too_deep = [&depth](int now, json::parse_event_t, json&) {
    depth = std::max(depth, now);
    return now <= kMaxDeep;
  };
  json parsed = json::parse(text, not_too_deep, false);
  if (parsed.is_discarded() || depth > kMaxDeep || !parsed.is_object()) throw BadInput("the message is no JSON object");
  return parsed;
}

template <class Value>
Value field(const json& message, const char* name, const Value& otherwise) {
  const auto found = message.find(name);
  if (found == message.end() || found->is_null()) return otherwise;
  try {
    return found->get<Value>();
  } catch (const json::exception&) {
    throw BadInput(fmt::format("the field {} has the wrong kind of value", name));
  }
}

std::string text(const json& message, const char* name) {
  return field<std::string>(message, name, "");
}

ask::Edit edit_of(const json& message) {
  ask::Edit edit;
  const auto changes = message.find("changes");
  if (changes == message.end() || !changes->is_array() || changes->size() > kMaxChanges)
    throw BadInput("an edit needs changes: [{path: [...], value: ...}, ...]");
  for (const json& change : *changes) {
    if (!change.is_object()) throw BadInput("a change needs path and value");
    edit.changes.push_back({field<std::vector<std::string>>(change, "path", {}), text(change, "value")});
  }
  return edit;
}

Command command_of(const std::string& name, const json& m) {
  static const std::map<std::string, std::function<Command(const json&)>> kCommands = {
      {"open_scene", [](const json& j) -> Command { return ask::OpenScene{text(j, "file")}; }},
      {"open_recording",
       [](const json& j) -> Command {
         return ask::OpenRecording{text(j, "left"), text(j, "right"), text(j, "stereo"), text(j, "calibration")};
       }},
      {"look", [](const json& j) -> Command { return ask::Look{field(j, "frame", 0)}; }},
      {"edit", [](const json& j) -> Command { return edit_of(j); }},
      {"undo", [](const json&) -> Command { return ask::Undo{}; }},
      {"redo", [](const json&) -> Command { return ask::Redo{}; }},
      {"save", [](const json& j) -> Command { return ask::Save{text(j, "name")}; }},
      {"build", [](const json&) -> Command { return ask::Build{}; }},
      {"start", [](const json& j) -> Command { return ask::Start{field(j, "realtime", true)}; }},
      {"stop", [](const json&) -> Command { return ask::Stop{}; }},
      {"mark", [](const json& j) -> Command { return ask::Mark{text(j, "text")}; }},
      {"rest", [](const json&) -> Command { return ask::Rest{}; }},
      {"record", [](const json& j) -> Command { return ask::Record{field(j, "on", true)}; }}};
  const auto found = kCommands.find(name);
  if (found == kCommands.end()) throw BadInput(fmt::format("'{}' is nothing that can be asked for", name));
  return found->second(m);
}

}  // namespace

ViewerMessage parse_viewer_message(const std::string& text_of_message) {
  const json parsed = parse(text_of_message);
  ViewerMessage message;
  message.id = field<int64_t>(parsed, "id", 0);
  if (parsed.contains("ping")) message.ping = field<double>(parsed, "ping", 0);
  if (parsed.contains("view")) {
    const json view = field<json>(parsed, "view", {});
    if (!view.is_object()) throw BadInput("view needs picture and shape");
    message.wants_picture = field(view, "picture", false);
    message.wants_shape = field(view, "shape", false);
  }
  if (parsed.contains("ask")) message.command = command_of(text(parsed, "ask"), parsed);
  return message;
}

std::string reply_json(int64_t id, const std::string& sentence) {
  json reply = {{"reply", id}};
  if (!sentence.empty()) reply["error"] = sentence;
  return reply.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string pong_json(double ping) {
  return json{{"pong", ping}}.dump();
}

}  // namespace palpate
