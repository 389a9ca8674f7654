#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "study/plan.h"

namespace palpate::study {

/// What the runs have left in `folder`, as one object that pages, tables and figures are made of: `columns` (name,
/// title), `experiments` (each with its texts, goals, `runs`, `findings`, and `sensitivity` where a setting is swept
/// that has a truth to compare with) and `ranking` (what matters most).
nlohmann::ordered_json gather_study(const Study& study, const Plan& plan, const std::filesystem::path& folder);

/// A figure of a table as a few digits; "-" where there is none.
std::string short_number(const nlohmann::ordered_json& value);

}  // namespace palpate::study
