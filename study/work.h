#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "study/plan.h"

namespace palpate::study {

constexpr const char* kSequenceDone = "done";
constexpr const char* kRunResult = "result.json";

/// How a sequence is made of a scene file, in a folder.
using Simulate = std::function<void(const std::filesystem::path& scene_file, const std::filesystem::path& folder)>;
/// How a scene file is estimated, into a folder, and compared with a truth (empty: none): the figures.
using Estimate = std::function<nlohmann::ordered_json(
    const std::filesystem::path& scene_file, const std::filesystem::path& folder, const std::filesystem::path& truth)>;

/// Makes one sequence in `folder`/sequences/NAME; one that is there already stays. Throws BadInput, Unfinished.
void make_sequence(const Sequence& sequence, const Study& study, const std::filesystem::path& folder,
                   const Simulate& simulate);

/// One estimate into `folder`/runs/NAME, with its settings (scene.yaml) and result.json: figures, or why there are
/// none (failed; skipped where the data of a real recording is not on this machine).
void make_run(const Run& run, const std::filesystem::path& folder, const Estimate& estimate);

bool sequence_is_there(const Sequence& sequence, const std::filesystem::path& folder);

/// What result.json of the run says; null where it has not run yet, or with other settings.
nlohmann::ordered_json result_of(const Run& run, const std::filesystem::path& folder);

std::filesystem::path sequence_folder(const std::string& sequence, const std::filesystem::path& folder);
std::filesystem::path run_folder(const Run& run, const std::filesystem::path& folder);

}  // namespace palpate::study
