#include "palpate/console/api.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "palpate/console/pictures.h"
#include "palpate/console/replay.h"
#include "palpate/core/errors.h"
#include "palpate/feedback/map_confidence.h"
#include "palpate/feedback/map_preview.h"
#include "palpate/feedback/warnings.h"
#include "palpate/session/scene_text.h"
#include "palpate/session/shape.h"

namespace palpate {

namespace {

using nlohmann::ordered_json;

constexpr int kThumbnailWidth_px = 240;
constexpr size_t kMaxFiles = 2000;

std::string text_of(const Query& query, const std::string& name) {
  const auto found = query.find(name);
  return found == query.end() ? "" : found->second;
}

int number_of(const Query& query, const std::string& name) {
  const std::string text = text_of(query, name);
  int number = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || last != text.data() + text.size() || number < 0)
    throw BadInput(fmt::format("{} is '{}', expected a whole number", name, text));
  return number;
}

Answer json_answer(const ordered_json& json) {
  return {200, "application/json", json.dump(-1, ' ', false, ordered_json::error_handler_t::replace)};
}

Answer jpeg_answer(const cv::Mat& picture) {
  return {200, "image/jpeg", jpeg_of(picture), true};
}

Answer missing(const std::string& sentence) {
  return {404, "text/plain; charset=utf-8", sentence};
}

Answer keys() {
  ordered_json rows = ordered_json::array();
  for (const KeyRow& row : scene_keys())
    rows.push_back({{"key", row.key}, {"default", row.default_text}, {"values", row.values}, {"meaning", row.meaning}});
  ordered_json warnings;
  for (const auto& [name, words] : known_warnings()) warnings[name] = words;
  Answer answer = json_answer({{"keys", rows}, {"warnings", warnings}});
  answer.may_be_kept = true;
  return answer;
}

std::string kind_of(const std::filesystem::directory_entry& entry) {
  static const std::set<std::string> kVideos = {".mp4", ".avi", ".mkv", ".mov", ".ts", ".m4v", ".mpg", ".webm"};
  static const std::set<std::string> kTexts = {".yaml", ".yml"};
  static const std::set<std::string> kCalibrations = {".xml", ".json", ".ini", ".txt"};
  std::error_code error;
  if (entry.is_directory(error)) {
    const bool is_run = std::filesystem::exists(entry.path() / "forces.csv", error) &&
                        std::filesystem::exists(entry.path() / "run.yaml", error);
    return is_run ? "run" : "folder";
  }
  std::string ending = entry.path().extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (kVideos.count(ending)) return "video";
  if (kTexts.count(ending))
    return entry.path().filename().string().find("scene") != std::string::npos ? "scene" : "yaml";
  return kCalibrations.count(ending) ? "calibration" : "";
}

Answer files(const RootFolder& root, const std::string& folder) {
  const std::filesystem::path inside = root.inside(folder);
  if (!std::filesystem::is_directory(inside)) return missing("there is no such folder");
  ordered_json list = ordered_json::array();
  std::vector<std::filesystem::directory_entry> entries;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(inside, error)) entries.push_back(entry);
  std::sort(entries.begin(), entries.end());
  for (const auto& entry : entries) {
    const std::string kind = kind_of(entry);
    if (kind.empty() || entry.path().filename().string().starts_with('.') || !root.holds(entry.path())) continue;
    list.push_back({{"name", entry.path().filename().string()}, {"file", root.name_of(entry.path())}, {"kind", kind}});
    if (list.size() >= kMaxFiles) break;
  }
  const std::string name = root.name_of(inside);
  return json_answer({{"folder", name == "." ? "" : name}, {"files", list}});
}

/// Not to be kept: pictures are numbered anew by each session, and those of a live source by their moment.
Answer answer_source(const std::string& name, const Snapshot& s) {
  if (!s.source) return missing("no recording is open");
  if (name == "left.jpg") return {200, "image/jpeg", jpeg_of(s.source->frame.left)};
  if (name == "pair.jpg" && !s.source->pair.left.empty()) {
    cv::Mat both;
    cv::hconcat(s.source->pair.left, s.source->pair.right, both);
    return {200, "image/jpeg", jpeg_of(both)};
  }
  return missing("there is no such picture");
}

Answer answer_map(const std::string& name, const Snapshot& s) {
  if (!s.map) return missing("there is no map yet");
  const BuiltMap& built = *s.map;
  if (name == "shape") return {200, "application/octet-stream", shape_bytes(built), true};
  if (name == "preview.jpg") return jpeg_answer(draw_map_preview(built.frame.left, built.rectification, built.map));
  if (name == "confidence.jpg")
    return jpeg_answer(draw_map_confidence(built.frame.left, built.rectification, built.map));
  return missing("there is no such part of a map");
}

Answer answer_replay(const std::string& name, const Query& query, const RootFolder& root) {
  const std::filesystem::path folder = root.inside(text_of(query, "folder"));
  if (!std::filesystem::is_regular_file(folder / "forces.csv")) return missing("that folder holds no finished run");
  for (const char* file : {"forces.csv", "overlay.mp4", "shapes.bin", "report.html", "marks.csv", "run.yaml"})
    if (!root.holds(folder / file)) return {403, "text/plain; charset=utf-8", "that run links to files elsewhere"};
  if (name == "rows") return replay_rows(folder);
  if (name == "picture") return replay_picture(folder, number_of(query, "frame"));
  if (name == "shape") return replay_shape(folder, number_of(query, "frame"));
  if (name == "report") return replay_report(folder);
  return missing("there is no such part of a run");
}

Answer answer(const Target& target, const Snapshot& s, const RootFolder& root) {
  const std::string& path = target.path;
  const auto below = [&path](const std::string& prefix) { return path.substr(prefix.size()); };
  if (path == "/api/keys") return keys();
  if (path == "/api/files") return files(root, text_of(target.query, "folder"));
  if (path == "/api/runs") return list_runs(root);
  if (path == "/api/thumbnail") {
    const cv::Mat picture = first_picture(root.inside(text_of(target.query, "file")));
    return {200, "image/jpeg", jpeg_of(picture, kThumbnailWidth_px), true};
  }
  if (path.starts_with("/api/source/")) return answer_source(below("/api/source/"), s);
  if (path.starts_with("/api/map/")) return answer_map(below("/api/map/"), s);
  if (path.starts_with("/api/replay/")) return answer_replay(below("/api/replay/"), target.query, root);
  return missing("there is nothing of that name");
}

/// Percent signs resolved; a plus is a plus.
std::string decoded(const std::string& text) {
  std::string result;
  for (size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    const bool coded = text[i] == '%' && i + 2 < text.size() + 0 &&
                       std::from_chars(text.data() + i + 1, text.data() + i + 3, value, 16).ptr == text.data() + i + 3;
    result += coded ? static_cast<char>(value) : text[i];
    if (coded) i += 2;
  }
  return result;
}

}  // namespace

Target parse_target(const std::string& target) {
  const size_t mark = target.find('?');
  Target parsed{decoded(target.substr(0, mark)), {}};
  size_t at = mark == std::string::npos ? target.size() : mark + 1;
  while (at < target.size()) {
    const size_t end = std::min(target.find('&', at), target.size());
    const std::string part = target.substr(at, end - at);
    const size_t equals = part.find('=');
    if (equals != std::string::npos) parsed.query[decoded(part.substr(0, equals))] = decoded(part.substr(equals + 1));
    at = end + 1;
  }
  return parsed;
}

Answer answer_api(const Target& target, const Snapshot& snapshot, const RootFolder& root) {
  try {
    return answer(target, snapshot, root);
  } catch (const BadInput& error) {
    return {400, "text/plain; charset=utf-8", error.what()};
  } catch (const std::exception& error) {
    return {500, "text/plain; charset=utf-8", error.what()};
  }
}

}  // namespace palpate
