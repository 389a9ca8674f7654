#include "study/collect.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "study/document.h"
#include "study/figures.h"
#include "study/files.h"
#include "study/page.h"
#include "study/results.h"

namespace palpate::study {

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

}  // namespace

Count collect_study(const Study& study, const Plan& plan, const std::filesystem::path& folder) {
  Count count;
  Json page = gather_study(study, plan, folder);
  count.drew_charts = write_study_figures(page, plan, folder);
  write_table(page, folder / "results.csv");
  write_file(folder / "results.md", study_document(page, false));
  write_file(folder / "report.html", html_page(study_document(page, true), folder));
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

}  // namespace palpate::study
