#include "app/answer.h"

#include <nlohmann/json.hpp>

namespace palpate::app {

namespace {

/// A path may hold bytes that are no UTF-8; JSON may not.
std::string text_of(const nlohmann::ordered_json& json) {
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string json_success(const nlohmann::ordered_json& figures) {
  nlohmann::ordered_json answer = {{"ok", true}};
  answer.update(figures);
  return text_of(answer);
}

std::string json_failure(const std::string& sentence, int exit_code) {
  return text_of({{"ok", false}, {"error", sentence}, {"exit_code", exit_code}});
}

nlohmann::ordered_json tissue_json(const TissueOptions& tissue) {
  nlohmann::ordered_json json = {{"law", law_name(tissue.law)},
                                 {"young_modulus_kPa", tissue.young_modulus_kPa},
                                 {"poisson_ratio", tissue.poisson_ratio}};
  if (tissue.modulus_unknown) json["young_modulus_kPa"] = "unknown";
  return json;
}

}  // namespace palpate::app
