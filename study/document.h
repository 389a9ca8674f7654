#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace palpate::study {

/// The study as a Markdown page with still pictures (`page` of gather_study and write_study_figures): goal beside
/// measured, what was found, and what matters most. `with_clips`: the overlay of an experiment of one run as a picture
/// too, an MP4.
std::string study_document(const nlohmann::ordered_json& page, bool with_clips);

}  // namespace palpate::study
