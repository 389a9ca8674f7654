#include "app/study_page.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/study_document.h"
#include "app/study_figures.h"
#include "app/study_page_parts.h"
#include "app/study_results.h"
#include "app/study_run.h"

namespace palpate::app {

namespace {

using Json = nlohmann::ordered_json;

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string csv_field(const Json& value) {
  return value.is_null() ? "" : csv_field(value.is_string() ? value.get<std::string>() : value.dump());
}

void write_table(const Json& page, const std::filesystem::path& file) {
  std::string table = "run,experiment,key,value,status,reason";
  for (const Json& column : page["columns"]) table += "," + column["name"].get<std::string>();
  table += ",warnings\n";
  for (const Json& experiment : page["experiments"])
    for (const Json& run : experiment["runs"]) {
      table += csv_field(run["name"]) + "," + csv_field(experiment["name"]) + "," + csv_field(experiment["key"]) + "," +
               csv_field(run["label"]) + "," + csv_field(run["status"]) + "," + csv_field(run["reason"]);
      for (const auto& [name, value] : run["figures"].items()) table += "," + csv_field(value);
      std::string warnings;
      for (const auto& [name, frames] : run["warnings"].items()) warnings += (warnings.empty() ? "" : ";") + name;
      table += "," + csv_field(warnings) + "\n";
    }
  write_file(file, table);
}

/// What the page shows beside its charts: the overlay of an experiment of one run, the maps of real recordings.
void embed_pictures(Json& page, const StudyPlan& plan, const std::filesystem::path& folder) {
  for (Json& experiment : page["experiments"]) {
    if (experiment["runs"].size() == 1)
      for (const StudyRun& run : plan.runs)
        if (run.experiment->name == experiment["name"])
          experiment["clip"] = data_uri(run_folder(run, folder) / "overlay.mp4", "video/mp4");
    for (Json& picture : experiment["pictures"])
      if (experiment["key"] == "scene")
        picture["data"] = data_uri(folder / picture["file"].get<std::string>(), "image/jpeg");
  }
}

}  // namespace

StudyCount collect_study(const Study& study, const StudyPlan& plan, const std::filesystem::path& folder) {
  StudyCount count;
  Json page = gather_study(study, plan, folder);
  count.drew_charts = write_study_figures(page, plan, folder);
  write_table(page, folder / "results.csv");
  write_file(folder / "results.md", study_document(page));
  embed_pictures(page, plan, folder);
  write_file(folder / "report.html", study_page_html(page));
  for (const Json& experiment : page["experiments"])
    for (const Json& run : experiment["runs"]) {
      const Json& status = run["status"];
      ++(status == "done"      ? count.done
         : status == "failed"  ? count.failed
         : status == "skipped" ? count.skipped
                               : count.missing);
    }
  return count;
}

}  // namespace palpate::app
