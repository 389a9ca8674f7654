#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/app/program.h"

namespace palpate::test {
namespace {

using testing::HasSubstr;

constexpr const char* kStudy = R"(title: Small
experiments:
  - name: plain
    scene: slab.yaml
    goals: {force_nrmse_pct: 25}
  - name: modulus
    scene: slab.yaml
    sweep: {key: tissue.young_modulus_kPa, unit: kPa, logarithmic: true, times: {from: 1, to: 100, steps: 3}}
    quick: 2
  - name: wrong
    scene: slab.yaml
    estimate: {map.thickness_mm: -1}
)";

int lines_with(const std::string& text, const std::string& part) {
  std::istringstream stream(text);
  int count = 0;
  for (std::string line; std::getline(stream, line);) count += line.find(part) != std::string::npos;
  return count;
}

/// Every text that the pattern's first group finds.
std::vector<std::string> found_in(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), expression), end; at != end; ++at) found.push_back((*at)[1]);
  return found;
}

class Study : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::copy_file(PALPATE_SOURCE_DIR "/tests/app/slab.yaml", workspace / "slab.yaml",
                               std::filesystem::copy_options::overwrite_existing);
    write_file(workspace / "study.yaml", kStudy);
  }
  Outcome study(const std::string& more) const {
    return run_palpate("study " + (workspace / "study.yaml").string() + " -o " + (workspace / "out").string() + " " +
                       more);
  }
  nlohmann::json result(const std::string& run) const {
    return nlohmann::json::parse(read_file(workspace / ("out/runs/" + run + "/result.json")));
  }
  const Workspace workspace;
};

TEST_F(Study, WhatTheEstimateAloneIsToldSharesOneSequence) {
  const Outcome outcome = study("--list-runs");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_EQ(lines_with(outcome.output, "--run sequence:slab-"), 1);
  EXPECT_EQ(lines_with(outcome.output, "--run modulus/"), 3);
  EXPECT_EQ(lines_with(outcome.output, "palpate study "), 6);
  EXPECT_EQ(lines_with(study("--list-runs --quick").output, "--run modulus/"), 2);
  EXPECT_EQ(lines_with(study("--list-runs --only plain").output, "palpate study "), 2);
}

TEST_F(Study, TheForceIsProportionalToTheModulusAndAFailedRunIsARowWithItsReason) {
  const Outcome outcome = study("--jobs 2 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto count = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(count["done"], 4);
  EXPECT_EQ(count["failed"], 1);
  EXPECT_NEAR(result("modulus/1000")["peak_force_N"].get<double>() / result("modulus/10")["peak_force_N"].get<double>(),
              100, 0.01);
  EXPECT_EQ(result("wrong/run")["status"], "failed");
  EXPECT_THAT(result("wrong/run")["reason"].get<std::string>(), HasSubstr("map.thickness_mm"));
  const std::string table = read_file(workspace / "out/results.csv");
  EXPECT_EQ(lines_with(table, ",done,"), 4);
  EXPECT_EQ(lines_with(table, ",failed,"), 1);
  const std::string page = read_file(workspace / "out/report.html");
  EXPECT_THAT(page, HasSubstr("to the power 1.000"));
  EXPECT_THAT(page, HasSubstr("<td>failed: "));
  EXPECT_THAT(page, HasSubstr("<video controls loop muted playsinline src=\"data:video/mp4;base64,"));
  for (const std::string& source : found_in(page, "src=\"(.{1,5})")) EXPECT_EQ(source, "data:");
}

TEST_F(Study, GoesOnWhereItStopped) {
  ASSERT_EQ(study("--run plain/run").exit_code, 0);
  const auto made = std::filesystem::last_write_time(workspace / "out/runs/plain/run/result.json");
  ASSERT_EQ(study("--only plain").exit_code, 0);
  EXPECT_EQ(std::filesystem::last_write_time(workspace / "out/runs/plain/run/result.json"), made);
  replace_in_file(workspace / "study.yaml", "goals: {force_nrmse_pct: 25}", "estimate: {map.elements: 700}");
  ASSERT_EQ(study("--only plain").exit_code, 0);
  EXPECT_NE(std::filesystem::last_write_time(workspace / "out/runs/plain/run/result.json"), made);
}

TEST_F(Study, AKilledRunIsLeftToTheNextTimeAndStopsNoOther) {
  // A log that cannot be written ends its run before it has a result.
  std::filesystem::create_directories(workspace / "out/runs/modulus/100/log.txt");
  const Outcome broken = study("--only modulus --json");
  EXPECT_EQ(broken.exit_code, 4);
  EXPECT_THAT(broken.error, HasSubstr("modulus/100"));
  EXPECT_EQ(result("modulus/10")["status"], "done");
  EXPECT_EQ(result("modulus/1000")["status"], "done");
  std::filesystem::remove_all(workspace / "out/runs/modulus/100/log.txt");
  EXPECT_EQ(study("--only modulus").exit_code, 0);
  EXPECT_EQ(result("modulus/100")["status"], "done");
}

/// A cluster of one: sbatch that runs every task of an array at once and waits.
constexpr const char* kSbatch = R"sh(#!/usr/bin/env bash
tasks=0
while [[ "$1" == --* ]]; do
  case $1 in --array=1-*) tasks=${1#--array=1-} ;; esac
  shift
done
if [ "$tasks" = 0 ]; then "./$1"; else for SLURM_ARRAY_TASK_ID in $(seq "$tasks"); do export SLURM_ARRAY_TASK_ID; "./$1" "$2"; done; fi >&2
echo 7
)sh";

TEST_F(Study, WhatItExportsForSlurmMakesTheSameResults) {
  ASSERT_EQ(study("--only plain").exit_code, 0);
  const std::string exported = (workspace / "cluster").string();
  ASSERT_EQ(run_palpate("study " + (workspace / "study.yaml").string() + " --only plain --export slurm -o " + exported)
                .exit_code,
            0);
  const std::filesystem::path tools = workspace / "tools";
  std::filesystem::create_directories(tools);
  write_file(tools / "sbatch", kSbatch);
  std::filesystem::permissions(tools / "sbatch", std::filesystem::perms::owner_all);
  std::filesystem::create_symlink(PALPATE_PROGRAM, tools / "palpate");
  const Outcome outcome = run("env", "PATH=" + tools.string() + ":$PATH " + exported + "/submit.sh");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const auto peak = [this](const std::string& folder) {
    return nlohmann::json::parse(read_file(workspace / (folder + "/runs/plain/run/result.json")))["peak_force_N"]
        .get<double>();
  };
  EXPECT_EQ(peak("cluster/results"), peak("out"));
  EXPECT_THAT(read_file(workspace / "cluster/results/results.csv"), HasSubstr("plain/run,plain,"));
}

TEST_F(Study, WhatItExportsForSnakemakeIsPythonThatNamesEveryJob) {
  const std::string exported = (workspace / "cluster").string();
  ASSERT_EQ(
      run_palpate("study " + (workspace / "study.yaml").string() + " --export snakemake -o " + exported).exit_code, 0);
  const std::string snakefile = read_file(workspace / "cluster/Snakefile");
  EXPECT_THAT(snakefile, HasSubstr("\"runs/modulus/1000/result.json\""));
  EXPECT_THAT(read_file(workspace / "cluster/profile/config.yaml"), HasSubstr(exported + "/profile/status.sh"));
  if (std::system("snakemake --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "snakemake is not installed";
  const Outcome outcome = run("snakemake", "--snakefile " + exported + "/Snakefile --dry-run --quiet");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
}

TEST_F(Study, WritesItsFiguresAsStillPictures) {
  ASSERT_EQ(study("--only modulus --jobs 2").exit_code, 0);
  const std::string page = read_file(workspace / "out/results.md");
  EXPECT_THAT(page, HasSubstr("to the power 1.000"));
  if (std::system("gnuplot --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
  const auto pictures = found_in(page, "\\]\\((figures/[^)]*)\\)");
  ASSERT_EQ(pictures.size(), 2U);
  const std::string chart = read_file(workspace / ("out/" + pictures[0]));
  EXPECT_THAT(chart, HasSubstr("tissue.young_modulus_kPa (kPa)"));
  EXPECT_THAT(chart, HasSubstr("peak force (N)"));
}

TEST_F(Study, TheSlopeOfAForceThatIsProportionalIsItsGainPerUnit) {
  replace_in_file(workspace / "study.yaml", "logarithmic: true, times: {from: 1, to: 100, steps: 3}",
                  "uncertainty: 2, values: [8, 10, 12]");
  ASSERT_EQ(study("--only modulus --jobs 2").exit_code, 0);
  const double per_kPa = 10 * result("modulus/10")["comparison"]["gain"].get<double>();
  const std::string page = read_file(workspace / "out/results.md");
  const auto slope = found_in(page, "Slope: \\+([0-9.]+) ± 0.00 % of the true force per kPa");
  ASSERT_EQ(slope.size(), 1U);
  EXPECT_NEAR(std::stod(slope[0]), per_kPa, 0.01);
  const auto ranked = found_in(page, "\\| modulus \\| \\+([0-9.]+) % \\| 2 kPa \\|");
  ASSERT_EQ(ranked.size(), 1U);
  EXPECT_NEAR(std::stod(ranked[0]), 2 * per_kPa, 0.1);
}

TEST_F(Study, LeavesOutRealRecordingsThatAreNotHere) {
  write_file(workspace / "real.yaml",
             "recording: {left: \"${PALPATE_NO_SUCH_DATA}/l.png\", right: \"${PALPATE_NO_SUCH_DATA}/r.png\"}");
  write_file(workspace / "study.yaml", "title: Real\nexperiments: [{name: real, scene: [real.yaml]}]\n");
  const Outcome outcome = study("--json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_EQ(nlohmann::json::parse(outcome.output)["skipped"], 1);
  EXPECT_THAT(read_file(workspace / "out/results.md"),
              HasSubstr("| real | skipped: the data is not here: PALPATE_NO_SUCH_DATA is not set |"));
}

TEST_F(Study, TheQuickFormKeepsValuesAsTheyAre) {
  replace_in_file(workspace / "study.yaml", "times: {from: 1, to: 100, steps: 3}", "values: [1, 2, 3, 4, 5, 6]");
  replace_in_file(workspace / "study.yaml", "quick: 2", "quick: 3");
  const std::string commands = study("--list-runs --quick --only modulus").output;
  EXPECT_EQ(found_in(commands, "--run modulus/(\\d)"), (std::vector<std::string>{"1", "3", "6"}));
  ASSERT_EQ(study("--quick --only modulus/3").exit_code, 0);
  EXPECT_EQ(result("modulus/3")["tissue"]["young_modulus_kPa"], 3);
}

TEST(StudyOfThePaper, ItsPageNamesEveryExperimentAndHasItsPictures) {
  const std::filesystem::path root = PALPATE_SOURCE_DIR;
  const std::string page = read_file(root / "docs/results.md");
  const auto names = found_in(read_file(root / "studies/paper.yaml"), "- name: (\\w+)\n");
  ASSERT_GT(names.size(), 10U);
  for (const std::string& name : names) EXPECT_THAT(page, HasSubstr("\n`" + name + "`"));
  const auto pictures = found_in(page, "\\]\\(([^)]*)\\)");
  ASSERT_GT(pictures.size(), 10U);
  for (const std::string& picture : pictures) EXPECT_TRUE(std::filesystem::exists(root / "docs" / picture)) << picture;
}

TEST_F(Study, SaysWhatIsWrongWithItsFile) {
  const auto sentence_of = [this](const std::string& from, const std::string& to) {
    write_file(workspace / "study.yaml", kStudy);
    replace_in_file(workspace / "study.yaml", from, to);
    const Outcome outcome = study("--list-runs");
    EXPECT_EQ(outcome.exit_code, 3);
    return outcome.error;
  };
  EXPECT_THAT(sentence_of("quick: 2", "quack: 2"), HasSubstr("study.yaml:9: unknown key quack"));
  EXPECT_THAT(sentence_of("name: modulus", "name: plain"), HasSubstr("two experiments have the name plain"));
  EXPECT_THAT(sentence_of("steps: 3", "steps: 1"), HasSubstr("range"));
  EXPECT_THAT(sentence_of("scene: slab.yaml\n    goals", "scene: slob.yaml\n    goals"),
              HasSubstr("slob.yaml: cannot"));
  EXPECT_THAT(sentence_of("title: Small", "titel: Small"), HasSubstr("study.yaml:1: unknown key titel"));
}

}  // namespace
}  // namespace palpate::test
