#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/study_file.h"

namespace palpate::app {

/// Makes one sequence in `folder`/sequences/NAME; one that is there already stays. Throws BadInput, Unfinished.
void make_sequence(const StudySequence& sequence, const Study& study, const std::filesystem::path& folder);

/// One estimate into `folder`/runs/NAME, with its settings (scene.yaml) and result.json: figures, or why there are
/// none (failed; skipped where the data of a real recording is not on this machine).
void make_run(const StudyRun& run, const std::filesystem::path& folder);

bool sequence_is_there(const StudySequence& sequence, const std::filesystem::path& folder);

/// What result.json of the run says; null where it has not run yet, or with other settings.
nlohmann::ordered_json result_of(const StudyRun& run, const std::filesystem::path& folder);

std::filesystem::path sequence_folder(const std::string& sequence, const std::filesystem::path& folder);
std::filesystem::path run_folder(const StudyRun& run, const std::filesystem::path& folder);

}  // namespace palpate::app
