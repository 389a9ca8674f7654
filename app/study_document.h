#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace palpate::app {

/// The study as a Markdown page with still pictures (`page` of gather_study and write_study_figures): goal beside
/// measured, what was found, and what matters most.
std::string study_document(const nlohmann::ordered_json& page);

}  // namespace palpate::app
