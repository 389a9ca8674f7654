#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "palpate/console/messages.h"
#include "palpate/console/row_json.h"
#include "palpate/core/clock.h"
#include "palpate/feedback/map_json.h"
#include "palpate/feedback/warnings.h"

namespace palpate {

namespace {

using nlohmann::ordered_json;

constexpr size_t kMaxRows = 500;

/// What the file says, scalars as they are written.
ordered_json tree_of(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  if (node.IsSequence()) {
    ordered_json list = ordered_json::array();
    for (const YAML::Node& item : node) list.push_back(tree_of(item));
    return list;
  }
  ordered_json map = ordered_json::object();
  if (node.IsMap())
    for (const auto& pair : node) map[pair.first.Scalar()] = tree_of(pair.second);
  return map;
}

ordered_json list_of(const Vec3& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

ordered_json scene_json(const Snapshot& s, const RootFolder& root) {
  const TissueOptions& tissue = s.scene.scene.tissue;
  return {{"file", root.name_of(s.scene_file)},
          {"text", s.scene_text},
          {"values", s.scene_text.empty() ? ordered_json::object() : tree_of(YAML::Load(s.scene_text))},
          {"saved", s.is_saved},
          {"can_undo", s.can_undo},
          {"can_redo", s.can_redo},
          {"law", law_name(tissue.law)},
          {"young_modulus", modulus_text(tissue)},
          {"poisson_ratio", tissue.poisson_ratio},
          {"force_unit", force_unit(tissue)}};
}

ordered_json source_json(const SourceView& source) {
  const StereoRig& rig = source.rectification.rig;
  const cv::Point2d field = field_of_view_deg(rig.left, source.size);
  return {{"width", source.size.width},
          {"height", source.size.height},
          {"fps", source.fps},
          {"frames", source.frame_count},
          {"frame", source.frame.index},
          {"focal_px", rounded(rig.left.K(0, 0))},
          {"baseline_mm", rounded(rig.baseline_mm())},
          {"field_of_view_deg", {rounded(field.x), rounded(field.y)}},
          {"rectified_focal_px", rounded(source.rectification.focal_px)},
          {"rectified_baseline_mm", rounded(source.rectification.baseline_mm)},
          {"timing", describe_timing(source.timing)},
          {"notes", source.notes},
          {"live", source.timing.is_live},
          {"silent", source.is_silent},
          {"picture", source.number}};
}

ordered_json map_state(const Snapshot& s) {
  if (!s.map) return nullptr;
  ordered_json json = ordered_json::parse(map_json(s.map->map, s.map->rectification));
  json["number"] = s.map_number;
  json["stale"] = s.map_is_stale;
  json["row_offset_px"] = rounded(s.map->map.disparity.row_offset_px);
  return json;
}

ordered_json run_state(const RunView& run, const RootFolder& root) {
  ordered_json json = {
      {"folder", root.name_of(run.folder)}, {"frames", run.frame_count}, {"over", run.over}, {"end", run.end},
      {"passed_over", run.passed_over},     {"dropped", run.dropped}};
  json["marks"] = ordered_json::array();
  for (const RunMark& mark : run.marks) json["marks"].push_back({mark.frame, rounded(mark.time_s), mark.text});
  if (!run.shown) return json;
  const ForceEstimate& estimate = run.shown->estimate;
  const FrameTimes& t = estimate.times;
  json["frame"] = estimate.frame;
  json["tip_mm"] = list_of(estimate.tip_mm);
  json["times_ms"] = {{"rectify", rounded(t.rectify_ms)}, {"track", rounded(t.track_ms)},
                      {"contact", rounded(t.contact_ms)}, {"solve", rounded(t.solve_ms)},
                      {"stress", rounded(t.stress_ms)},   {"draw", rounded(t.draw_ms)}};
  json["answer_ms"] = rounded(static_cast<double>(run.shown_ns - run.shown->decoded_ns) * 1e-6);
  json["waited_ms"] = rounded(static_cast<double>(run.shown->decoded_ns - run.shown->taken_ns) * 1e-6);
  json["warnings"] = ordered_json::array();
  for (const std::string& warning : estimate.warnings) json["warnings"].push_back(warning_words(warning));
  return json;
}

ordered_json kept_json(const KeptView& kept, const RootFolder& root) {
  return {{"folder", root.name_of(kept.folder)}, {"frames", kept.frames}, {"seconds", rounded(kept.seconds)},
          {"left_out", kept.left_out},           {"over", kept.over},     {"end", kept.end}};
}

}  // namespace

std::string state_json(const Snapshot& s, const RootFolder& root, ToldSoFar& told, bool& has_more) {
  ordered_json json = {{"version", s.version}, {"phase", phase_name(s.phase)}, {"sentence", s.sentence}};
  json["may_open_live"] = s.may_open_live;
  json["stages"] = ordered_json::array();
  for (const StageTime& stage : s.stages) json["stages"].push_back({stage.stage, std::round(stage.ms)});
  const bool scene_is_new = told.nothing || told.scene_file != s.scene_file || told.scene_text != s.scene_text ||
                            told.is_saved != s.is_saved || told.can_undo != s.can_undo || told.can_redo != s.can_redo;
  if (scene_is_new) json["scene"] = scene_json(s, root);
  if (told.source != s.source || scene_is_new) json["source"] = s.source ? source_json(*s.source) : ordered_json();
  if (told.map != s.map || told.map_is_stale != s.map_is_stale || scene_is_new) json["map"] = map_state(s);
  told.nothing = false;
  told.scene_file = s.scene_file;
  told.scene_text = s.scene_text;
  told.is_saved = s.is_saved;
  told.can_undo = s.can_undo;
  told.can_redo = s.can_redo;
  told.source = s.source;
  told.map = s.map;
  told.map_is_stale = s.map_is_stale;
  has_more = false;
  json["kept"] = s.kept ? kept_json(*s.kept, root) : ordered_json();
  json["run"] = s.run ? run_state(*s.run, root) : ordered_json();
  const std::shared_ptr<const RowLog> log = s.run ? s.run->rows : nullptr;
  if (log != told.log) {
    told.log = log;
    told.rows = 0;
  }
  if (log) {
    json["rows_from"] = told.rows;
    json["rows"] = ordered_json::array();
    for (const ForceRow& row : log->from(told.rows, kMaxRows)) json["rows"].push_back(row_json(row));
    told.rows += json["rows"].size();
    has_more = told.rows < log->size();
  }
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace palpate
