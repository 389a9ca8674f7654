#pragma once

#include <CLI/CLI.hpp>
#include <stdexcept>

namespace palpate::app {

constexpr int kDone = 0;
constexpr int kOurBug = 1;
constexpr int kWrongUse = 2;
constexpr int kBadInput = 3;
constexpr int kNotFinished = 4;

/// The command line asks for what is not there.
struct WrongUse : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Each adds its verb to the command line. The verb's work runs in its callback and throws BadInput or Unfinished.
void add_demo(CLI::App& app);
void add_simulate(CLI::App& app);
void add_map(CLI::App& app);
void add_estimate(CLI::App& app);
void add_compare(CLI::App& app);
void add_check(CLI::App& app);
void add_modulus(CLI::App& app);
void add_study(CLI::App& app);
void add_console(CLI::App& app);
void add_benchmark(CLI::App& app);

}  // namespace palpate::app
