#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "palpate/elastic/material.h"

namespace palpate::app {

/// What a verb answers with --json: {"ok": true, ...}, one object.
std::string json_success(const nlohmann::ordered_json& figures);

/// {"ok": false, "error": sentence, "exit_code": 3}.
std::string json_failure(const std::string& sentence, int exit_code);

/// {"law": ..., "young_modulus_kPa": ..., "poisson_ratio": ...}
nlohmann::ordered_json tissue_json(const TissueOptions& tissue);

}  // namespace palpate::app
