#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "study/jobs.h"

namespace palpate::study {

/// Runs another program in a folder and waits for it, its words on standard error; its exit code, 127 where it is
/// missing. Once `stopped`, it is told to end (SIGINT).
int run_program(
    const std::vector<std::string>& words, const std::filesystem::path& folder,
    const std::function<bool()>& stopped = [] { return false; });

/// Runs the jobs on this machine by ninja, at most `at_once` together; one that fails does not stop the others. Writes
/// study.ninja into `folder`. Throws BadInput where ninja is missing, Unfinished once `stopped`.
void run_by_ninja(const std::vector<Job>& jobs, const std::filesystem::path& folder, int at_once, bool quiet,
                  const std::function<bool()>& stopped);

/// For Snakemake, on a cluster that Slurm runs: Snakefile, profile/config.yaml and profile/status.sh in `to`.
/// `collect`: command line after the last job; `folder`: absolute, where results go.
void export_snakemake(const std::vector<Job>& jobs, const std::vector<std::string>& collect,
                      const std::filesystem::path& folder, const std::filesystem::path& to);

/// For Slurm alone: sequences.txt and runs.txt (a command line each), array.sh and submit.sh in `to`.
void export_slurm(const std::vector<Job>& jobs, const std::vector<std::string>& collect,
                  const std::filesystem::path& folder, const std::filesystem::path& to);

}  // namespace palpate::study
